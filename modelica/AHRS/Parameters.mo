within AHRS;
package Parameters "Defaults of the models"
  extends Icons.Package;
  package Quadrotor "quadrotor"
    extends Icons.Package;
    constant Real mass = 1.0;
    constant Real inertia[3] = {0.0095, 0.01, 0.018};
    constant Real gravity = 9.80665;
    constant Real initial_position[3] = {0.0, 0.0, 0.0};
    constant Real initial_velocity[3] = {0.0, 0.0, 0.0};
    constant Real initial_q[4] = {1.0, 0.0, 0.0, 0.0};
    constant Real initial_rate[3] = {0.0, 0.0, 0.0};
    constant Real initial_rotor_speed = 434.27;
    constant Real arm_length = 0.225;
    constant Real rotor_height = 0.03;
    constant Real thrust_coefficient = 1.3e-5;
    constant Real torque_coefficient = 2.35e-7;
    constant Real rotor_drag_coefficient = 1.5e-4;
    constant Real rotor_inertia = 3.0e-5;
    constant Real rotor_time_constant = 0.03;
    constant Real rotor_speed_min = 100.0;
    constant Real rotor_speed_max = 750.0;
    constant Real drag_area[3] = {0.015, 0.015, 0.030};
    constant Real air_density = 1.225;
    constant Real imu_position[3] = {0.02, 0.01, -0.015};
  end Quadrotor;
  package IMU
    constant Real sample_time = 0.004;
  end IMU;
  package GCF
    constant Real sample_time = 0.01;
    constant Real kp = 0.5;
    constant Real ki = 0.1;
  end GCF;
  package Mahony
    constant Real sample_time = 0.01;
    constant Real kp = 1.0;
    constant Real ki = 0.1;
  end Mahony;
  package AttitudeController
    constant Real sample_time = 0.004;
    constant Real rate_gain[3] = {20.0, 20.0, 6.0};
    constant Real rate_integral_gain[3] = {20.0, 20.0, 3.0};
    constant Real attitude_gain[3] = {6.0, 6.0, 2.5};
    constant Real rate_limit[3] = {4.0, 4.0, 1.5};
    constant Real integral_limit[3] = {10.0, 10.0, 2.0};
    constant Real initial_thrust = 9.80665;
    constant Real inertia[3] = {0.0095, 0.01, 0.018};
    constant Real arm_length = 0.225;
    constant Real thrust_coefficient = 1.3e-5;
    constant Real torque_coefficient = 2.35e-7;
    constant Real rotor_speed_min = 100.0;
    constant Real rotor_speed_max = 750.0;
  end AttitudeController;
end Parameters;
