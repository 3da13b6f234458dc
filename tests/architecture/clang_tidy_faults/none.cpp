// No fault: the notation of frames and units is no fault of naming.
struct Reading {
  double X_WC = 0.0;
  double p_WF = 0.0;
  double v_WF_C = 0.0;
  double position_W_mm = 0.0;
  double ecg_mV = 0.0;
  double rate_Hz = 0.0;
};

double sum(const Reading& reading, double R, double P, double R_CW, double hand_eye_X_SC) {
  const double S = R * P;
  const double M_0 = R_CW * hand_eye_X_SC;
  return S + M_0 + reading.X_WC + reading.p_WF + reading.v_WF_C + reading.position_W_mm + reading.ecg_mV +
         reading.rate_Hz;
}
