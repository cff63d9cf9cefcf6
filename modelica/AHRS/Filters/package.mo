within AHRS;
package Filters "Attitude estimators"
  extends Icons.Package;
  annotation(Icon(graphics = {
      Line(points = {{-70, 40}, {-20, 38}, {0, 10}, {25, -25}, {75, -60}}, color = {200, 90, 0}, thickness = 1.0, smooth = Smooth.Bezier),
      Line(points = {{-75, -60}, {-25, -25}, {0, 10}, {20, 38}, {75, 40}}, color = {0, 85, 150}, thickness = 1.0, smooth = Smooth.Bezier)}),
    Documentation(info = "<html><p>See <a href=\"modelica://AHRS.UsersGuide.ComplementaryFilters\">the theory in one page</a>.</p></html>"));
end Filters;
