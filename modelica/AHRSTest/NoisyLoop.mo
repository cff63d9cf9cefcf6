within AHRSTest;
model NoisyLoop "The closed-loop example with a sensor that has errors"
  extends AHRS.Examples.ClosedLoopQuadrotor(imu(gyro_noise_density = 1e-4, gyro_bias_walk = 1e-5, gyro_bias = {0.01, -0.008, 0.005}, accel_noise_density = 3e-3,
    mag_noise_density = 5e-8, seed = 11));
  annotation(experiment(StopTime = 10, Interval = 0.004, Tolerance = 1e-8),
    Documentation(info = "<html><p>The loop stays stable and the error within what the sensor explains.</p></html>"));
end NoisyLoop;
