within AHRSTest;
model QuadrotorFlight "Quadrotor on rotor commands held over 4 ms, in wind"
  extends AHRS.Icons.Example;
  parameter AHRS.Types.Time sample_time = 0.004 "Interval of the commands";
  AHRS.Plants.Quadrotor quadrotor annotation(Placement(transformation(extent = {{-20, -20}, {20, 20}})));
protected
  discrete Real command[4](start = fill(434.27, 4), each fixed = true) "Held rotor speeds";
  discrete Real wind[3](each start = 0, each fixed = true) "Held wind";
equation
  when sample(0, sample_time) then
    command = fill(440, 4) + 3*cos(2.5*time)*{-1, 1, 1, -1} + 2*cos(1.7*time)*{1, -1, 1, -1} + 9*sin(0.7*time)*{1, 1, -1, -1};
    wind = {2*sin(0.5*time), 1.0, 0.3*cos(time)};
  end when;
  quadrotor.rotor_speed_command = command;
  quadrotor.wind = wind;
  annotation(experiment(StopTime = 10, Interval = 0.004, Tolerance = 1e-10),
    Documentation(info = "<html><p>The C model holds its inputs over a tick; so does this one.</p></html>"));
end QuadrotorFlight;
