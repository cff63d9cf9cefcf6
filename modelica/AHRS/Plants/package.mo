within AHRS;
package Plants "Vehicles"
  extends Icons.Package;
  annotation(Icon(graphics = {
      Line(points = {{-50, 50}, {50, -50}}, color = {80, 80, 80}, thickness = 1.0),
      Line(points = {{-50, -50}, {50, 50}}, color = {80, 80, 80}, thickness = 1.0),
      Ellipse(extent = {{-75, 75}, {-25, 25}}, lineColor = {0, 85, 150}, thickness = 1.0),
      Ellipse(extent = {{25, 75}, {75, 25}}, lineColor = {0, 85, 150}, thickness = 1.0),
      Ellipse(extent = {{-75, -25}, {-25, -75}}, lineColor = {0, 85, 150}, thickness = 1.0),
      Ellipse(extent = {{25, -25}, {75, -75}}, lineColor = {0, 85, 150}, thickness = 1.0)}),
    Documentation(info = "<html><p>Navigation axes are north, east, down; body axes are front, right, down.</p></html>"));
end Plants;
