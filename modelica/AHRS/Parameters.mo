within AHRS;
package Parameters "Defaults of the models, generated from their descriptors"
  extends Icons.Package;
  package AttitudeController "Attitude controller of a quadrotor"
    extends Icons.Package;
    constant Real sample_time = 0.004 "Interval of the controller [s]";
    constant Real attitude_gain[3] = {6.0, 6.0, 2.5} "Wanted rate over attitude error, body axes [1/s]";
    constant Real rate_gain[3] = {20.0, 20.0, 6.0} "Angular acceleration over rate error, body axes [1/s]";
    constant Real rate_integral_gain[3] = {20.0, 20.0, 3.0} "Angular acceleration over integrated rate error, body axes [1/s2]";
    constant Real rate_limit[3] = {4.0, 4.0, 1.5} "Greatest wanted rate, body axes [rad/s]";
    constant Real integral_limit[3] = {10.0, 10.0, 2.0} "Greatest integral part, body axes [rad/s2]";
    constant Real inertia[3] = {0.0095, 0.01, 0.018} "Principal moments of inertia of the vehicle [kg.m2]";
    constant Real arm_length = 0.225 "From the centre to a rotor, seen from above [m]";
    constant Real thrust_coefficient = 1.3e-05 "Thrust over squared rotor speed [N.s2/rad2]";
    constant Real torque_coefficient = 2.35e-07 "Drag torque over squared rotor speed [N.m.s2/rad2]";
    constant Real rotor_speed_min = 100.0 "Lowest rotor speed [rad/s]";
    constant Real rotor_speed_max = 750.0 "Highest rotor speed [rad/s]";
    constant Real initial_thrust = 9.80665 "Total thrust before the first sample [N]";
    annotation(Documentation(info = "<html><p>Defaults of the model <code>attitude_controller</code>.</p></html>"));
  end AttitudeController;

  package GCF "Generalized complementary filter"
    extends Icons.Package;
    constant Real sample_time = 0.01 "Sample interval of the estimator [s]";
    constant Real declination = 0.0 "Magnetic declination, east positive: turns the navigation frame from magnetic to true north [rad]";
    constant Real gravity = 9.80665 "Local gravity [m/s2]";
    constant Real field_magnitude = 5e-05 "Magnitude of the local field, used when field_reference is given [T]";
    constant Real field_dip = 1.1 "Dip of the local field below the horizon, used when field_reference is given [rad]";
    constant Real q0[4] = {1.0, 0.0, 0.0, 0.0} "First attitude, in the frame of the output, used when initialisation is given; scaled to unit length";
    constant Real init_time = 0.0 "Time over which samples are averaged for the first attitude; 0 takes the first usable sample [s]";
    constant Boolean motion_compensation = false "Subtract the estimated motion acceleration from the accelerometer; tilt is then observed more slowly";
    constant Real motion_time_constant = 1.0 "How long an acceleration is taken for motion before it is taken for tilt; infinity never takes it back [s]";
    constant Boolean accel_gating = false "Ignore the accelerometer while its magnitude is far from gravity";
    constant Real accel_gate = 1.0 "Deviation of the specific force from gravity beyond which the accelerometer is ignored [m/s2]";
    constant Real accel_gate_time = 10.0 "Longest time without the accelerometer; then it is used until it has been inside the gate once [s]";
    constant Integer gyro_zero_samples = 0 "Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0 switches it off";
    constant Real gyro_zero_std = 0.02 "Standard deviation per sample and axis above which the vehicle is not at rest: about three times the sensor's [rad/s]";
    constant Real gyro_zero_limit = 0.1 "Largest zero of the gyroscope that is believed; more is a rotation [rad/s]";
    constant Real accel_cutoff = 0.0 "Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off [Hz]";
    constant Real mag_offset[3] = {0.0, 0.0, 0.0} "Hard iron, subtracted from the magnetometer, body axes [T]";
    constant Real mag_gain[3] = {1.0, 1.0, 1.0} "What the magnetometer without its offset is multiplied with, body axes";
    constant Real kp = 0.5 "Proportional gain: about the crossover frequency between accelerometer/magnetometer and gyroscope [rad/s]";
    constant Real ki = 0.1 "Integral gain: how fast the gyroscope bias is learned; 0 makes the filter first order [rad2/s2]";
    constant Real kii = 0.0 "Double integral gain: follows a ramp of the gyroscope bias; 0 leaves the filter second order [rad3/s3]";
    constant Real bias_limit = 1.0 "Largest gyroscope bias that is learned, per axis [rad/s]";
    constant Real kg = 1.0 "Weight of the gravity error, used when error is coupled";
    constant Real kh = 1.0 "Weight of the magnetic field error, used when error is coupled";
    annotation(Documentation(info = "<html><p>Defaults of the model <code>gcf</code>.</p></html>"));
  end GCF;

  package IMU "Inertial measurement unit with magnetometer"
    extends Icons.Package;
    constant Real sample_time = 0.004 "Interval between samples [s]";
    constant Real declination = 0.0 "Magnetic declination, east positive [rad]";
    constant Real field_magnitude = 5e-05 "Magnitude of the local field [T]";
    constant Real field_dip = 1.1 "Dip of the local field below the horizon [rad]";
    constant Integer seed = 1 "Seed of every random number";
    constant Boolean errors = true "False: a perfect sensor that samples";
    constant Real vibration_accel = 0.3 "Acceleration by the imbalance of one rotor at vibration_speed [m/s2]";
    constant Real vibration_blade = 0.5 "Vertical acceleration by the two blades of one rotor at vibration_speed [m/s2]";
    constant Real vibration_gyro = 0.01 "Angular rate by the imbalance of one rotor at vibration_speed [rad/s]";
    constant Real vibration_speed = 434.27 "Rotor speed at which the vibration has the amplitudes given; they grow with its square [rad/s]";
    constant Real hard_iron[3] = {0.0, 0.0, 0.0} "Field that the vehicle adds, body axes [T]";
    constant Real soft_iron[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0} "Matrix that distorts the field, row by row";
    constant Real gyro_noise_density = 0.00012 "White noise of the gyroscope, rad/s/sqrt(Hz)";
    constant Real gyro_noise_std = 0.0 "Further white noise of the gyroscope per sample, whatever the interval [rad/s]";
    constant Real gyro_bias[3] = {0.0, 0.0, 0.0} "Constant bias of the gyroscope [rad/s]";
    constant Real gyro_turn_on_bias = 0.0087 "Standard deviation of a bias of the gyroscope that is drawn once [rad/s]";
    constant Real gyro_bias_instability = 8.7e-05 "Standard deviation of the wandering bias of the gyroscope [rad/s]";
    constant Real gyro_bias_time = 100.0 "Correlation time of the wandering bias of the gyroscope [s]";
    constant Real gyro_bias_walk = 5e-06 "Random walk of the bias of the gyroscope, rad/s2/sqrt(Hz)";
    constant Real gyro_scale[3] = {0.0, 0.0, 0.0} "Relative scale error of the gyroscope";
    constant Real gyro_misalignment[3] = {0.0, 0.0, 0.0} "Small rotation of the axes of the gyroscope against the body [rad]";
    constant Real gyro_bandwidth = 92.0 "Corner frequency of the low-pass in the gyroscope; 0 is none [Hz]";
    constant Real gyro_delay = 0.0 "Transport delay of the gyroscope, rounded to whole samples [s]";
    constant Real gyro_rate = 0.0 "Output rate of the gyroscope; between outputs the last reading is held and not valid; 0 is every sample [Hz]";
    constant Real gyro_quantisation = 0.0010642 "Least significant bit of the gyroscope; 0 is none [rad/s]";
    constant Real gyro_saturation = 34.9066 "Largest magnitude of a reading of the gyroscope; 0 is no limit [rad/s]";
    constant Real accel_noise_density = 0.0021 "White noise of the accelerometer, m/s2/sqrt(Hz)";
    constant Real accel_noise_std = 0.0 "Further white noise of the accelerometer per sample, whatever the interval [m/s2]";
    constant Real accel_bias[3] = {0.0, 0.0, 0.0} "Constant bias of the accelerometer [m/s2]";
    constant Real accel_turn_on_bias = 0.05 "Standard deviation of a bias of the accelerometer that is drawn once [m/s2]";
    constant Real accel_bias_instability = 0.00098 "Standard deviation of the wandering bias of the accelerometer [m/s2]";
    constant Real accel_bias_time = 100.0 "Correlation time of the wandering bias of the accelerometer [s]";
    constant Real accel_bias_walk = 0.0 "Random walk of the bias of the accelerometer, m/s3/sqrt(Hz)";
    constant Real accel_scale[3] = {0.0, 0.0, 0.0} "Relative scale error of the accelerometer";
    constant Real accel_misalignment[3] = {0.0, 0.0, 0.0} "Small rotation of the axes of the accelerometer against the body [rad]";
    constant Real accel_bandwidth = 94.0 "Corner frequency of the low-pass in the accelerometer; 0 is none [Hz]";
    constant Real accel_delay = 0.0 "Transport delay of the accelerometer, rounded to whole samples [s]";
    constant Real accel_rate = 0.0 "Output rate of the accelerometer; between outputs the last reading is held and not valid; 0 is every sample [Hz]";
    constant Real accel_quantisation = 0.004788 "Least significant bit of the accelerometer; 0 is none [m/s2]";
    constant Real accel_saturation = 156.9 "Largest magnitude of a reading of the accelerometer; 0 is no limit [m/s2]";
    constant Real mag_noise_density = 0.0 "White noise of the magnetometer, T/sqrt(Hz)";
    constant Real mag_noise_std = 6e-07 "Further white noise of the magnetometer per sample, whatever the interval [T]";
    constant Real mag_bias[3] = {0.0, 0.0, 0.0} "Constant bias of the magnetometer [T]";
    constant Real mag_turn_on_bias = 0.0 "Standard deviation of a bias of the magnetometer that is drawn once [T]";
    constant Real mag_bias_instability = 0.0 "Standard deviation of the wandering bias of the magnetometer [T]";
    constant Real mag_bias_time = 100.0 "Correlation time of the wandering bias of the magnetometer [s]";
    constant Real mag_bias_walk = 0.0 "Random walk of the bias of the magnetometer, T/s/sqrt(Hz)";
    constant Real mag_scale[3] = {0.0, 0.0, 0.0} "Relative scale error of the magnetometer";
    constant Real mag_misalignment[3] = {0.0, 0.0, 0.0} "Small rotation of the axes of the magnetometer against the body [rad]";
    constant Real mag_bandwidth = 0.0 "Corner frequency of the low-pass in the magnetometer; 0 is none [Hz]";
    constant Real mag_delay = 0.0 "Transport delay of the magnetometer, rounded to whole samples [s]";
    constant Real mag_rate = 100.0 "Output rate of the magnetometer; between outputs the last reading is held and not valid; 0 is every sample [Hz]";
    constant Real mag_quantisation = 1.5e-07 "Least significant bit of the magnetometer; 0 is none [T]";
    constant Real mag_saturation = 0.0048 "Largest magnitude of a reading of the magnetometer; 0 is no limit [T]";
    annotation(Documentation(info = "<html><p>Defaults of the model <code>imu</code>.</p></html>"));
  end IMU;

  package Mahony "Mahony's complementary filter with decoupled heading"
    extends Icons.Package;
    constant Real sample_time = 0.01 "Sample interval of the estimator [s]";
    constant Real declination = 0.0 "Magnetic declination, east positive: turns the navigation frame from magnetic to true north [rad]";
    constant Real gravity = 9.80665 "Local gravity [m/s2]";
    constant Real field_magnitude = 5e-05 "Magnitude of the local field, used when field_reference is given [T]";
    constant Real field_dip = 1.1 "Dip of the local field below the horizon, used when field_reference is given [rad]";
    constant Real q0[4] = {1.0, 0.0, 0.0, 0.0} "First attitude, in the frame of the output, used when initialisation is given; scaled to unit length";
    constant Real init_time = 0.0 "Time over which samples are averaged for the first attitude; 0 takes the first usable sample [s]";
    constant Boolean motion_compensation = false "Subtract the estimated motion acceleration from the accelerometer; tilt is then observed more slowly";
    constant Real motion_time_constant = 1.0 "How long an acceleration is taken for motion before it is taken for tilt; infinity never takes it back [s]";
    constant Boolean accel_gating = false "Ignore the accelerometer while its magnitude is far from gravity";
    constant Real accel_gate = 1.0 "Deviation of the specific force from gravity beyond which the accelerometer is ignored [m/s2]";
    constant Real accel_gate_time = 10.0 "Longest time without the accelerometer; then it is used until it has been inside the gate once [s]";
    constant Integer gyro_zero_samples = 0 "Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0 switches it off";
    constant Real gyro_zero_std = 0.02 "Standard deviation per sample and axis above which the vehicle is not at rest: about three times the sensor's [rad/s]";
    constant Real gyro_zero_limit = 0.1 "Largest zero of the gyroscope that is believed; more is a rotation [rad/s]";
    constant Real accel_cutoff = 0.0 "Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off [Hz]";
    constant Real mag_offset[3] = {0.0, 0.0, 0.0} "Hard iron, subtracted from the magnetometer, body axes [T]";
    constant Real mag_gain[3] = {1.0, 1.0, 1.0} "What the magnetometer without its offset is multiplied with, body axes";
    constant Real kp = 1.0 "Proportional gain: about the crossover frequency between accelerometer/magnetometer and gyroscope [rad/s]";
    constant Real ki = 0.1 "Integral gain: how fast the gyroscope bias is learned; 0 switches that off [rad2/s2]";
    constant Real bias_limit = 0.2 "Largest gyroscope bias that is learned, per axis [rad/s]";
    annotation(Documentation(info = "<html><p>Defaults of the model <code>mahony</code>.</p></html>"));
  end Mahony;

  package Quadrotor "Quadrotor with six degrees of freedom"
    extends Icons.Package;
    constant Real sample_time = 0.004 "Interval between outputs [s]";
    constant Real gravity = 9.80665 "Local gravity [m/s2]";
    constant Real inner_step = 0.001 "Longest step of the integration [s]";
    constant Real mass = 1.0 "Mass [kg]";
    constant Real inertia[3] = {0.0095, 0.01, 0.018} "Principal moments of inertia about the centre of mass [kg.m2]";
    constant Real arm_length = 0.225 "From the centre to a rotor, seen from above [m]";
    constant Real rotor_height = 0.03 "Rotor plane above the centre of mass [m]";
    constant Real thrust_coefficient = 1.3e-05 "Thrust over squared rotor speed [N.s2/rad2]";
    constant Real torque_coefficient = 2.35e-07 "Drag torque over squared rotor speed [N.m.s2/rad2]";
    constant Real rotor_drag_coefficient = 0.00015 "Force in the rotor plane over rotor speed and air speed [N.s2/m/rad]";
    constant Real rotor_inertia = 3e-05 "Inertia of a rotor about its shaft [kg.m2]";
    constant Real rotor_time_constant = 0.03 "Time constant of the rotor speed [s]";
    constant Real rotor_speed_min = 100.0 "Lowest rotor speed that is obeyed [rad/s]";
    constant Real rotor_speed_max = 750.0 "Highest rotor speed that is obeyed [rad/s]";
    constant Real drag_area[3] = {0.015, 0.015, 0.03} "Drag coefficient times area, body axes [m2]";
    constant Real air_density = 1.225 "Density of the air [kg/m3]";
    constant Real imu_position[3] = {0.02, 0.01, -0.015} "Place of the IMU, body axes, from the centre of mass [m]";
    constant Real initial_position[3] = {0.0, 0.0, 0.0} "Position at the start, navigation axes [m]";
    constant Real initial_velocity[3] = {0.0, 0.0, 0.0} "Velocity at the start, navigation axes [m/s]";
    constant Real initial_q[4] = {1.0, 0.0, 0.0, 0.0} "Attitude at the start; scaled to unit length";
    constant Real initial_rate[3] = {0.0, 0.0, 0.0} "Angular rate at the start, body axes [rad/s]";
    constant Real initial_rotor_speed = 434.27 "Speed of all rotors at the start; the default is hover [rad/s]";
    constant Boolean ground = false "The plane of zero height carries the landing gear";
    constant Real leg_length = 0.12 "Feet below the centre of mass, used when there is a ground [m]";
    constant Real ground_stiffness = 2000.0 "Stiffness of the ground per foot [N/m]";
    constant Real ground_damping = 20.0 "Damping of the ground per foot [N.s/m]";
    constant Real ground_friction = 0.6 "Friction over normal force";
    constant Real slip_speed = 0.05 "Speed below which friction fades out [m/s]";
    annotation(Documentation(info = "<html><p>Defaults of the model <code>quadrotor</code>.</p></html>"));
  end Quadrotor;

  annotation(Icon(graphics = {
      Line(points = {{-60, 40}, {60, 40}}, color = {80, 80, 80}, thickness = 1.0),
      Line(points = {{-60, -40}, {60, -40}}, color = {80, 80, 80}, thickness = 1.0),
      Ellipse(extent = {{-35, 55}, {-5, 25}}, lineColor = {0, 85, 150}, thickness = 1.0),
      Ellipse(extent = {{15, -25}, {45, -55}}, lineColor = {0, 85, 150}, thickness = 1.0)}),
    Documentation(info = "<html><p>Written by <code>python -m ahrs_fmu.export.modelica</code> from the
files that the FMUs are built from: change those, not this one.</p></html>"));
end Parameters;
