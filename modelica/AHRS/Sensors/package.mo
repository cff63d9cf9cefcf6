within AHRS;
package Sensors "Inertial measurement units"
  extends Icons.Package;
  annotation(Icon(graphics = {
      Rectangle(extent = {{-50, 50}, {50, -50}}, lineColor = {80, 80, 80}, fillColor = {225, 225, 225}, fillPattern = FillPattern.Solid),
      Line(points = {{-30, -30}, {30, -30}}, color = {200, 90, 0}, thickness = 1.0, arrow = {Arrow.None, Arrow.Filled}),
      Line(points = {{-30, -30}, {-30, 32}}, color = {0, 85, 150}, thickness = 1.0, arrow = {Arrow.None, Arrow.Filled})}),
    Documentation(info = "<html><p>From the truth of a vehicle to what an estimator gets to see.</p></html>"));
end Sensors;
