model TooManyEquations "The attitude of the sensor is given twice"
  AHRS.Sensors.IdealIMU imu(q = {1, 0, 0, 0}, rate = zeros(3), specific_force = {0, 0, -9.8});
equation
  imu.q = {1, 0, 0, 0};
end TooManyEquations;
