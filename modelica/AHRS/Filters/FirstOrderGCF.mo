within AHRS.Filters;
block FirstOrderGCF "Continuous complementary filter, H(s) = KP"
  extends ContinuousGCF;
equation
  gyro_bias = zeros(3);
  annotation(
    Icon(graphics = {Text(extent = {{50, -20}, {90, -60}}, textColor = {80, 80, 80}, textString = "1")}),
    Documentation(info = "<html><p>Time constant 1/KP. A constant gyroscope bias b leaves the error b/KP.</p></html>"));
end FirstOrderGCF;
