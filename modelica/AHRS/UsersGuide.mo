within AHRS;
package UsersGuide "User's guide"
  extends Icons.Information;

  class Overview "What is in the library"
    extends Icons.Information;
    annotation(Documentation(info = "<html>
<p>A loop around an attitude estimator has four parts, and each is a package:</p>
<table border=\"1\" cellspacing=\"0\" cellpadding=\"3\">
<tr><th>package</th><th>part of the loop</th></tr>
<tr><td><a href=\"modelica://AHRS.Plants\">Plants</a></td><td>what moves: a rigid body, a rotor, a quadrotor</td></tr>
<tr><td><a href=\"modelica://AHRS.Sensors\">Sensors</a></td><td>what is measured: an ideal IMU, a sampled IMU with errors</td></tr>
<tr><td><a href=\"modelica://AHRS.Filters\">Filters</a></td><td>what is believed: complementary filters, continuous and sampled</td></tr>
<tr><td><a href=\"modelica://AHRS.Controllers\">Controllers</a></td><td>what is done about it: attitude controller with motor mixer</td></tr>
</table>
<p>Every estimator has the same bus in and the same outputs, so one can be redeclared for another. Parameters, inputs and outputs are named as in the
project's FMUs: a block and the FMU of the same name take the same wires.</p>
</html>"));
  end Overview;

  class Conventions "Axes, quaternions, signs"
    extends Icons.Information;
    annotation(Documentation(info = "<html>
<ul>
<li>Navigation axes: north, east, down. Body axes: front, right, down.</li>
<li>A quaternion is Hamilton's, scalar first, and turns body vectors into navigation vectors: <code>v_n = q v_b q*</code>.</li>
<li>The accelerometer measures specific force: at rest and level <code>(0, 0, -g)</code>.</li>
<li>Roll, pitch and yaw are applied in the order yaw, pitch, roll; yaw counts from magnetic north, clockwise seen from above.</li>
<li>Sampled blocks tick at <code>sample_time, 2 sample_time, ...</code>; their first output is the start value.</li>
</ul>
</html>"));
  end Conventions;

  class ComplementaryFilters "Theory in one page"
    extends Icons.Information;
    annotation(Documentation(info = "<html>
<p>A gyroscope knows fast turns and drifts; accelerometer and magnetometer know the direction of gravity and north and are disturbed by motion.
A complementary filter integrates the rate and pulls the result towards the measured direction with the law <code>H(s)</code>:</p>
<pre>
G_A(s) = H/(s + H)        measured direction to estimate: low-pass
G_B(s) = s/(s + H)        integrated rate to estimate: high-pass
G_A + G_B = 1
</pre>
<table border=\"1\" cellspacing=\"0\" cellpadding=\"3\">
<tr><th>order</th><th>H(s)</th><th>removes</th></tr>
<tr><td>first</td><td><code>KP</code></td><td>an initial error; a constant rate bias b leaves b/KP</td></tr>
<tr><td>second</td><td><code>KP + KI/s</code></td><td>a constant bias; natural frequency sqrt(KI), damping KP/(2 sqrt(KI))</td></tr>
<tr><td>third</td><td><code>KP + KI/s + KII/s^2</code></td><td>a bias that grows steadily; stable if KP KI &gt; KII</td></tr>
</table>
<p>On the sphere of attitudes the error is a rotation vector in body axes. Built from gravity and the horizontal field
(<a href=\"modelica://AHRS.Functions.gravityError\">gravityError</a> + <a href=\"modelica://AHRS.Functions.headingError\">headingError</a>)
it has the same gain about every axis, so the scalar formulas above hold for roll, pitch and yaw alike.
<a href=\"modelica://AHRS.Examples.FrequencyResponse\">Examples.FrequencyResponse</a> measures them.</p>
</html>"));
  end ComplementaryFilters;

  class Verification "How the library is checked"
    extends Icons.Information;
    annotation(Documentation(info = "<html>
<p>The library is written from the equations and the C models of the FMUs are written from the same equations by a different path; tests compare the two:
the quadrotor on equal rotor commands, the sampled filter on equal samples, and the whole loop. Two independent compilers read every class. The package
<code>AHRSTest</code> holds the models of these tests.</p>
</html>"));
  end Verification;

  class ReleaseNotes "Changes between versions"
    extends Icons.Information;
    annotation(Documentation(info = "<html><p>0.1.0: first version.</p></html>"));
  end ReleaseNotes;
  annotation(DocumentationClass = true, Documentation(info = "<html><p>Read <a href=\"modelica://AHRS.UsersGuide.Overview\">Overview</a> and
<a href=\"modelica://AHRS.UsersGuide.Conventions\">Conventions</a> first.</p></html>"));
end UsersGuide;
