within AHRS;
package Icons "Drawings shared by the classes of the library"
  extends Icons.Package;

  partial package Package "Frame of a package"
    annotation(Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Rectangle(extent = {{-100, 100}, {100, -100}}, radius = 20, lineColor = {120, 120, 120}, fillColor = {248, 248, 248}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Rounded frame in which a package draws its own sign.</p></html>"));
  end Package;

  partial class Information "Page of text"
    annotation(Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Ellipse(extent = {{-100, 100}, {100, -100}}, lineColor = {0, 85, 150}, fillColor = {0, 85, 150}, fillPattern = FillPattern.Solid),
      Ellipse(extent = {{-14, 68}, {14, 40}}, lineColor = {255, 255, 255}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid),
      Rectangle(extent = {{-14, 26}, {14, -66}}, lineColor = {255, 255, 255}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Sign of a page of the user's guide.</p></html>"));
  end Information;

  partial function Function "Function"
    annotation(Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Ellipse(extent = {{-100, 100}, {100, -100}}, lineColor = {108, 88, 49}, fillColor = {255, 250, 235}, fillPattern = FillPattern.Solid),
      Text(extent = {{-90, 70}, {90, -70}}, textColor = {108, 88, 49}, textString = "f"),
      Text(extent = {{-150, 145}, {150, 105}}, textColor = {0, 0, 255}, textString = "%name")}),
      Documentation(info = "<html><p>Sign of a function.</p></html>"));
  end Function;

  partial model Example "Model that can be simulated as it is"
    annotation(Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Ellipse(extent = {{-100, 100}, {100, -100}}, lineColor = {75, 138, 73}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid),
      Polygon(points = {{-36, 60}, {64, 0}, {-36, -60}, {-36, 60}}, lineColor = {75, 138, 73}, fillColor = {75, 138, 73}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Sign of an example.</p></html>"));
  end Example;

  partial block Block "Frame of a block with its name above"
    annotation(Icon(coordinateSystem(extent = {{-100, -100}, {100, 100}}), graphics = {
      Rectangle(extent = {{-100, 100}, {100, -100}}, lineColor = {0, 0, 127}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid),
      Text(extent = {{-150, 145}, {150, 105}}, textColor = {0, 0, 255}, textString = "%name")}),
      Documentation(info = "<html><p>Frame of a signal block.</p></html>"));
  end Block;

  partial block Filter "Low-pass and high-pass that cross"
    extends Icons.Block;
    annotation(Icon(graphics = {
      Line(points = {{-80, -70}, {80, -70}}, color = {150, 150, 150}),
      Line(points = {{-70, -80}, {-70, 75}}, color = {150, 150, 150}),
      Line(points = {{-70, 40}, {-20, 38}, {0, 20}, {25, -15}, {75, -60}}, color = {200, 90, 0}, thickness = 0.8, smooth = Smooth.Bezier),
      Line(points = {{-65, -60}, {-25, -15}, {0, 20}, {20, 38}, {75, 40}}, color = {0, 85, 150}, thickness = 0.8, smooth = Smooth.Bezier)}),
      Documentation(info = "<html><p>Sign of an attitude estimator.</p></html>"));
  end Filter;
  annotation(Icon(graphics = {
      Rectangle(extent = {{-60, 50}, {10, -20}}, lineColor = {0, 85, 150}, thickness = 1.0),
      Ellipse(extent = {{-10, 20}, {60, -50}}, lineColor = {200, 90, 0}, thickness = 1.0)}),
    Documentation(info = "<html><p>Partial classes that carry nothing but a drawing.</p></html>"));
end Icons;
