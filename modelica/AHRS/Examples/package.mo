within AHRS;
package Examples "Models to simulate"
  extends Icons.Package;
  annotation(Icon(graphics = {
      Polygon(points = {{-36, 60}, {64, 0}, {-36, -60}, {-36, 60}}, lineColor = {75, 138, 73}, fillColor = {75, 138, 73}, fillPattern = FillPattern.Solid)}),
    Documentation(info = "<html><p>Complete models; each says what to look at.</p></html>"));
end Examples;
