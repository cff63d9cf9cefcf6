model PartialModel "A filter without its law of the bias"
  AHRS.Sensors.IdealIMU imu(q = {1, 0, 0, 0}, rate = zeros(3), specific_force = {0, 0, -9.8});
  AHRS.Filters.ContinuousGCF filter;
equation
  connect(imu.imu, filter.imu);
end PartialModel;
