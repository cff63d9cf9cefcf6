within AHRSTest;
model Dropouts "Sampled filters that begin without a magnetometer and lose sensors for a while"
  extends AHRS.Icons.Example;
  parameter AHRS.Types.Time sample_time = 0.02 "Sampling interval";
  AHRS.Filters.GCF gcf(sample_time = sample_time, bias_limit = 0.003) annotation(Placement(transformation(extent = {{20, 0}, {60, 40}})));
  AHRS.Filters.Mahony mahony(sample_time = sample_time, bias_limit = 0.003) annotation(Placement(transformation(extent = {{20, -60}, {60, -20}})));
  AHRS.Sensors.IMU imu(sample_time = sample_time, errors = false) annotation(Placement(transformation(extent = {{-40, -20}, {0, 20}})));
  Boolean accel_valid "From 0.1 s on, and not around 6 s";
  Boolean mag_valid "From 2 s on, and not around 7 s";
protected
  AHRS.Types.Angle euler[3] "True roll, pitch, yaw";
equation
  euler = {0.9*sin(0.8*time), 0.6*sin(1.3*time), 1 + 2*sin(0.3*time)};
  imu.q = AHRS.Functions.fromEuler(euler);
  imu.rate = AHRS.Functions.bodyRate(euler, {0.72*cos(0.8*time), 0.78*cos(1.3*time), 0.6*cos(0.3*time)});
  imu.specific_force = AHRS.Functions.rotateBack(imu.q, {0.5*sin(2*time), 0.3*cos(3*time), -9.80665});
  accel_valid = time > 0.09 and not (time > 5.51 and time < 6.51);
  mag_valid = time > 2.01 and not (time > 6.01 and time < 8.01);
  gcf.imu.gyro = imu.imu.gyro;
  gcf.imu.accel = imu.imu.accel;
  gcf.imu.mag = imu.imu.mag;
  gcf.imu.accel_valid = accel_valid;
  gcf.imu.mag_valid = mag_valid;
  mahony.imu.gyro = imu.imu.gyro;
  mahony.imu.accel = imu.imu.accel;
  mahony.imu.mag = imu.imu.mag;
  mahony.imu.accel_valid = accel_valid;
  mahony.imu.mag_valid = mag_valid;
  annotation(experiment(StopTime = 10, Interval = 0.02, Tolerance = 1e-6),
    Documentation(info = "<html><p>Validity changes between samples, never at one, so that every implementation sees the same.</p></html>"));
end Dropouts;
