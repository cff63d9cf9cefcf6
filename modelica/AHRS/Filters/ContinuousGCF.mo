within AHRS.Filters;
partial block ContinuousGCF "What the continuous filters have in common"
  extends Interfaces.Estimator(q(start = initial_q, each fixed = true));
  parameter Types.Frequency kp = Parameters.GCF.kp "Proportional gain";
  parameter Types.Quaternion initial_q = {1, 0, 0, 0} "Attitude at the start";
  Types.Angle error[3] "Rotation from the estimated to the measured attitude, body axes";
equation
  error = Functions.attitudeError(q, imu.accel, imu.mag, imu.accel_valid, imu.mag_valid);
  rate = imu.gyro - gyro_bias;
  der(q) = Functions.derivative(q, rate + kp*error);
  annotation(Documentation(info = "<html>
<pre>
q' = 1/2 q * (0, gyro - b + KP e)
e  = f/|f| x q* (0, 0, -1) q + q* (0, 0, -h_E/|h|) q
</pre>
<p>The orders differ in the law of the bias b.</p>
</html>"));
end ContinuousGCF;
