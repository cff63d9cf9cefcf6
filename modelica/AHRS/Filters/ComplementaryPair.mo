within AHRS.Filters;
block ComplementaryPair "Scalar low-pass and high-pass that add up to one"
  extends Icons.Filter;
  parameter Types.Frequency kp = Parameters.GCF.kp "Proportional gain";
  parameter Types.SquaredFrequency ki = Parameters.GCF.ki "Integral gain; zero gives the first order";
  Interfaces.RealInput angle(final unit = "rad") "Angle from accelerometer or magnetometer" annotation(Placement(transformation(extent = {{-140, 40}, {-100, 80}})));
  Interfaces.RealInput rate(final unit = "rad/s") "Rate from the gyroscope" annotation(Placement(transformation(extent = {{-140, -80}, {-100, -40}})));
  Interfaces.RealOutput estimate(final unit = "rad") "Sum of both parts" annotation(Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealOutput low(start = 0, fixed = true, final unit = "rad") "Part that comes from the angle" annotation(Placement(transformation(extent = {{100, 50}, {120, 70}})));
  Interfaces.RealOutput high(start = 0, fixed = true, final unit = "rad") "Part that comes from the rate" annotation(Placement(transformation(extent = {{100, -70}, {120, -50}})));
protected
  Types.AngularVelocity low_integral(start = 0, fixed = true) "Integral of the low-pass";
  Types.AngularVelocity high_integral(start = 0, fixed = true) "Integral of the high-pass";
equation
  der(low) = kp*(angle - low) + low_integral;
  der(low_integral) = ki*(angle - low);
  der(high) = rate - kp*high - high_integral;
  der(high_integral) = ki*high;
  estimate = low + high;
  annotation(Documentation(info = "<html>
<pre>
low  = (KP s + KI)/(s^2 + KP s + KI) angle
high = s^2/(s^2 + KP s + KI) rate/s
</pre>
<p>Fed with an angle and its true rate the two parts add up to the angle exactly, whatever the gains: that is what complementary means.
An error in one of the two inputs goes through its own filter alone.</p>
</html>"));
end ComplementaryPair;
