within;
package AHRSTest "Models that the tests of AHRS simulate"
  extends AHRS.Icons.Package;
  annotation(
    version = "0.1.0",
    uses(AHRS(version = "0.1.0")),
    Icon(graphics = {Line(points = {{-55, 0}, {-15, -45}, {60, 50}}, color = {75, 138, 73}, thickness = 2.0)}),
    Documentation(info = "<html><p>Every class here extends <code>AHRS.Icons.Example</code> and runs as it is. What each result is compared with is in tests/modelica.</p></html>"));
end AHRSTest;
