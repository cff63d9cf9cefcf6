within AHRSTest;
model Mixing "Motor mixer from easy to impossible demands"
  extends AHRS.Icons.Example;
  parameter Real arm = 0.159 "Front and right distance of the rotors";
  parameter Real torque_ratio = 0.018 "Drag torque over thrust";
  parameter Real thrust_min = 0.13 "Least thrust of a rotor";
  parameter Real thrust_max = 7.3 "Greatest thrust of a rotor";
  Real thrust "Wanted thrust";
  Real torque[3] "Wanted moment";
  Real y[7] "Result of the mixer";
  Real achieved_thrust "Thrust of all rotors";
  Real achieved_torque[3] "Moment of all rotors";
equation
  thrust = 10 + 25*sin(0.9*time);
  torque = {time*0.2*sin(3*time), time*0.15*cos(2*time), 0.05*time*sin(1.3*time)};
  y = AHRS.Controllers.mix(thrust, torque, arm, torque_ratio, thrust_min, thrust_max);
  achieved_thrust = y[1] + y[2] + y[3] + y[4];
  achieved_torque = {arm*(-y[1] + y[2] + y[3] - y[4]), arm*(y[1] - y[2] + y[3] - y[4]), torque_ratio*(y[1] + y[2] - y[3] - y[4])};
  annotation(experiment(StopTime = 10, Interval = 0.01, Tolerance = 1e-6),
    Documentation(info = "<html><p>Inside the limits demand and result agree; beyond them every rotor stays within its limits.</p></html>"));
end Mixing;
