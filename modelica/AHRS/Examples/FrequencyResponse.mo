within AHRS.Examples;
model FrequencyResponse "Gain and phase of the complementary pair, measured with sines"
  extends Icons.Example;
  parameter Types.Frequency kp = 0.5 "Proportional gain";
  parameter Types.SquaredFrequency ki = 0.1 "Integral gain";
  parameter Integer n = 7 "Number of frequencies";
  parameter Types.Frequency frequency[n] = {0.1, 0.2, 0.4, 0.6, 1, 2, 4} "Frequencies, multiples of 0.1 rad/s";
  parameter Types.Time settled = 100 "When the start has died out";
  Filters.ComplementaryPair low[n](each kp = kp, each ki = ki) "Driven by the angle" annotation(Placement(transformation(extent = {{-40, 20}, {0, 60}})));
  Filters.ComplementaryPair high[n](each kp = kp, each ki = ki) "Driven by the rate" annotation(Placement(transformation(extent = {{-40, -60}, {0, -20}})));
  Real gain_A[n] "Measured gain of the low-pass";
  Real gain_B[n] "Measured gain of the high-pass";
  Real phase_A[n](each unit = "rad") "Measured phase of the low-pass";
  Real phase_B[n](each unit = "rad") "Measured phase of the high-pass";
  Real theory_A[n] "Gain of the low-pass by formula";
  Real theory_B[n] "Gain of the high-pass by formula";
protected
  parameter Types.Time window = 62.83185307179586 "Whole periods of every multiple of 0.1 rad/s";
  Real inside "Weight of the correlation";
  Real in_phase_A[n](each start = 0, each fixed = true) "Correlation with the sine";
  Real quadrature_A[n](each start = 0, each fixed = true) "Correlation with the cosine";
  Real in_phase_B[n](each start = 0, each fixed = true) "Correlation with the sine";
  Real quadrature_B[n](each start = 0, each fixed = true) "Correlation with the cosine";
equation
  inside = if time > settled and time < settled + window then 2/window else 0;
  for i in 1:n loop
    low[i].angle = sin(frequency[i]*time);
    low[i].rate = 0;
    high[i].angle = 0;
    high[i].rate = frequency[i]*cos(frequency[i]*time);
    der(in_phase_A[i]) = inside*low[i].estimate*sin(frequency[i]*time);
    der(quadrature_A[i]) = inside*low[i].estimate*cos(frequency[i]*time);
    der(in_phase_B[i]) = inside*high[i].estimate*sin(frequency[i]*time);
    der(quadrature_B[i]) = inside*high[i].estimate*cos(frequency[i]*time);
    gain_A[i] = sqrt(in_phase_A[i]^2 + quadrature_A[i]^2);
    gain_B[i] = sqrt(in_phase_B[i]^2 + quadrature_B[i]^2);
    phase_A[i] = atan2(quadrature_A[i], in_phase_A[i]);
    phase_B[i] = atan2(quadrature_B[i], in_phase_B[i]);
    theory_A[i] = sqrt((ki^2 + (kp*frequency[i])^2)/((ki - frequency[i]^2)^2 + (kp*frequency[i])^2));
    theory_B[i] = frequency[i]^2/sqrt((ki - frequency[i]^2)^2 + (kp*frequency[i])^2);
  end for;
  annotation(experiment(StopTime = 165, Interval = 0.1, Tolerance = 1e-8),
    Documentation(info = "<html>
<p>Each frequency drives one pair through the angle and one through the rate. From 100 s on the outputs are correlated with sine and cosine over 20 pi seconds, whole periods of them all; at the end
<code>gain_A</code> and <code>gain_B</code> equal</p>
<pre>
|G_A(jw)| = sqrt((KI^2 + KP^2 w^2)/((KI - w^2)^2 + KP^2 w^2))
|G_B(jw)| = w^2/sqrt((KI - w^2)^2 + KP^2 w^2)
</pre>
</html>"));
end FrequencyResponse;
