within AHRS;
package Controllers "Controllers that act on an estimated attitude"
  extends Icons.Package;
  annotation(Icon(graphics = {
      Ellipse(extent = {{-70, 20}, {-30, -20}}, lineColor = {80, 80, 80}, thickness = 1.0),
      Line(points = {{-30, 0}, {60, 0}}, color = {80, 80, 80}, thickness = 1.0, arrow = {Arrow.None, Arrow.Filled}),
      Line(points = {{30, 0}, {30, -50}, {-50, -50}, {-50, -22}}, color = {80, 80, 80}, thickness = 1.0, arrow = {Arrow.None, Arrow.Filled})}),
    Documentation(info = "<html><p>Sampled, as on a vehicle.</p></html>"));
end Controllers;
