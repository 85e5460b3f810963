"""The monitor: samples become residuals, friction estimates and alarms."""
