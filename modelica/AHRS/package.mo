within;
package AHRS "Attitude and heading reference systems: vehicle, sensors, complementary filters and closed loops"
  extends AHRS.Icons.Package;
  annotation(
    version = "0.1.0",
    Icon(graphics = {
      Line(points = {{-70, -55}, {70, -55}}, color = {160, 160, 160}),
      Line(points = {{-60, -55}, {50, 45}}, color = {0, 85, 150}, thickness = 1.0, arrow = {Arrow.None, Arrow.Filled}),
      Line(points = {{-20, -55}, {-24, -36}, {-33, -31}}, color = {200, 90, 0}, thickness = 1.0),
      Ellipse(extent = {{-66, -49}, {-54, -61}}, fillColor = {0, 85, 150}, fillPattern = FillPattern.Solid, lineColor = {0, 85, 150})}),
    Documentation(info = "<html>
<p>Blocks for engineers who estimate roll, pitch and yaw from a gyroscope, an accelerometer and a magnetometer,
and who want to see the estimator inside the vehicle that it steers.</p>
<p>The library stands alone: it needs no other library, and its signal connectors fit those of Modelica.Blocks.
Start with <a href=\"modelica://AHRS.UsersGuide\">the user's guide</a> or simulate
<a href=\"modelica://AHRS.Examples.ClosedLoopQuadrotor\">Examples.ClosedLoopQuadrotor</a>.</p>
</html>"));
end AHRS;
