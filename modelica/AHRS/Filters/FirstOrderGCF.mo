within AHRS.Filters;
block FirstOrderGCF "Continuous complementary filter, H(s) = KP"
  extends ContinuousGCF;
equation
  gyro_bias = zeros(3);
  annotation(Documentation(info = "<html><p>Time constant 1/KP. A constant gyroscope bias b leaves the error b/KP.</p></html>"));
end FirstOrderGCF;
