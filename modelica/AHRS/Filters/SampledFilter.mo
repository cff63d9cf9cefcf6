within AHRS.Filters;
partial block SampledFilter "Variables that the sampled filters have in common"
  extends Interfaces.Estimator(q(start = {1, 0, 0, 0}, each fixed = true), rate(each start = 0, each fixed = true), gyro_bias(each start = 0, each fixed = true));
protected
  discrete Real before[4](start = {1, 0, 0, 0}, each fixed = true) "Attitude before the prediction";
  discrete Real predicted[4](start = {1, 0, 0, 0}, each fixed = true) "Attitude carried forward by the gyroscope";
  discrete Real error[3](each start = 0, each fixed = true) "Rotation from the predicted to the measured attitude, body axes";
  Boolean started(start = false, fixed = true) "There is an attitude";
  Boolean aligned(start = false, fixed = true) "There is a heading";
  annotation(
    Icon(graphics = {Line(points = {{40, -85}, {40, -78}, {55, -78}, {55, -85}, {70, -85}, {70, -78}, {85, -78}}, color = {80, 80, 80})}),
    Documentation(info = "<html>
<p>The first usable samples give the first attitude; a filter that had to begin without a magnetometer turns to north with the first one. From then on each tick predicts</p>
<pre>
q^- = q * exp((gyro - b) T)                 predict
e   = e_gravity(q^-) + e_heading(q^-)       error at the prediction
</pre>
<p>and the filters differ in how they use the error. A tick's equations stand together in each filter, because they depend on each other within the tick.</p>
</html>"));
end SampledFilter;
