within AHRS.Filters;
block SecondOrderGCF "Continuous complementary filter, H(s) = KP + KI/s"
  extends ContinuousGCF(gyro_bias(each start = 0, each fixed = true));
  parameter Types.SquaredFrequency ki = Parameters.GCF.ki "Integral gain";
equation
  der(gyro_bias) = -ki*error;
  annotation(
    Icon(graphics = {Text(extent = {{50, -20}, {90, -60}}, textColor = {80, 80, 80}, textString = "2")}),
    Documentation(info = "<html><pre>b' = -KI e</pre><p>Natural frequency sqrt(KI), damping KP/(2 sqrt(KI)). The integral lives in body axes, where a gyroscope's bias is constant.</p></html>"));
end SecondOrderGCF;
