within AHRS.Filters;
block ThirdOrderGCF "Continuous complementary filter, H(s) = KP + KI/s + KII/s^2"
  extends ContinuousGCF(gyro_bias(each start = 0, each fixed = true));
  parameter Types.SquaredFrequency ki = Parameters.GCF.ki "Integral gain";
  parameter Types.CubedFrequency kii = 0.01 "Gain of the double integral, below kp ki";
  Types.AngularAcceleration bias_rate[3](each start = 0, each fixed = true) "Estimated growth of the bias, negative";
equation
  der(gyro_bias) = -(ki*error + bias_rate);
  der(bias_rate) = kii*error;
  annotation(
    Icon(graphics = {Text(extent = {{50, -20}, {90, -60}}, textColor = {80, 80, 80}, textString = "3")}),
    Documentation(info = "<html><pre>
b' = -(KI e + c)
c' = KII e
</pre><p>Stable if <code>KP KI &gt; KII &gt; 0</code>. Follows a bias that grows steadily without error.</p></html>"));
end ThirdOrderGCF;
