within AHRS.Sensors;
block IdealIMU "Continuous IMU without errors"
  extends Interfaces.Sensor;
equation
  imu.gyro = rate;
  imu.accel = specific_force;
  imu.mag = Functions.rotateBack(q, field);
  imu.accel_valid = true;
  imu.mag_valid = true;
  annotation(Documentation(info = "<html><p>The bus carries the truth: <code>gyro = w</code>, <code>accel = f</code>, <code>mag = q* B q</code>.</p></html>"));
end IdealIMU;
