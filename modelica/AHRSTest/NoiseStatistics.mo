within AHRSTest;
model NoiseStatistics "Noise of an IMU at rest"
  extends AHRS.Icons.Example;
  AHRS.Sensors.IMU imu(sample_time = 0.01, gyro_noise_density = 0.1, accel_noise_density = 0.2, mag_noise_std = 3, seed = 42,
    q = {1, 0, 0, 0}, rate = {0, 0, 0}, specific_force = {0, 0, 0}, field_magnitude = 0, gyro_bias_walk = 0) annotation(Placement(transformation(extent = {{-20, -20}, {20, 20}})));
  AHRS.Sensors.IMU other(sample_time = 0.01, gyro_noise_density = 0.1, seed = 43,
    q = {1, 0, 0, 0}, rate = {0, 0, 0}, specific_force = {0, 0, 0}, field_magnitude = 0, gyro_bias_walk = 0) annotation(Placement(transformation(extent = {{-20, -80}, {20, -40}})));
  annotation(experiment(StopTime = 10, Interval = 0.01, Tolerance = 1e-6),
    Documentation(info = "<html><p>Sample deviations are density over the root of the interval: 1 and 2, and 3 for the magnetometer.</p></html>"));
end NoiseStatistics;
