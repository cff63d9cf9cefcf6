within AHRSTest;
model NoisyLoop "The closed-loop example with a sensor that has errors"
  extends AHRS.Examples.ClosedLoopQuadrotor(sensor_errors = true, imu(gyro_bias = {0.01, -0.008, 0.005}, seed = 11));
  annotation(experiment(StopTime = 10, Interval = 0.004, Tolerance = 1e-8),
    Documentation(info = "<html><p>The loop stays stable and the error within what the sensor explains.</p></html>"));
end NoisyLoop;
