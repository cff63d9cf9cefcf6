model WrongDimension "A rate with two elements"
  AHRS.Sensors.IdealIMU imu(q = {1, 0, 0, 0}, specific_force = {0, 0, -9.8});
  Real two[2] = {1, 2};
equation
  imu.rate = two;
end WrongDimension;
