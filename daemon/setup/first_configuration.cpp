#include "daemon/setup/first_configuration.hpp"

#include <fmt/format.h>

namespace perimap {
namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string set(const std::string& key, const std::string& value, const std::string& otherwise) {
  return value.empty() ? fmt::format("# {} = {}\n", key, quoted(otherwise))
                       : fmt::format("{} = {}\n", key, quoted(value));
}

std::string camera_section(const SetupAnswers& answers, const std::string& file) {
  std::string text = "[camera]\n# where the camera is: \"v4l2:/dev/...\", or \"video:FILE\" in its place\n";
  text += set("device", answers.camera, "v4l2:/dev/v4l/by-id/usb-camera-video-index0");
  text += fmt::format(
      "# its lens. To measure it: show a board from all sides while perimap record -c {0} board.mcap runs, then\n"
      "#   perimap calibrate camera --from board.mcap --square-mm 8 --output camera.yaml --configuration {0}\n",
      file);
  text += set("calibration", answers.calibration, "camera.yaml");
  return text;
}

std::string tracker_section(const SetupAnswers& answers, const std::string& file) {
  std::string text = "\n[tracker]\n# what it speaks: \"ndi\" or \"igtl\"; \"none\": there is none\n";
  text += fmt::format("protocol = {}\n", quoted(answers.tracker_protocol.empty() ? "none" : answers.tracker_protocol));
  text += "# where it is: a serial port's path, or \"tcp:HOST:PORT\"\n";
  text += set("port", answers.tracker_port, "/dev/serial/by-id/usb-NDI");
  if (answers.tracker_protocol == "ndi") {
    text += "# of its frame numbers: 60 for Polaris, 40 for Aurora\nframe_rate_hz = 60.0\n";
  }
  text +=
      "# the sensor on the scope, the patient's reference and the pointer: port handles (ndi) or names (igtl)\n"
      "# sensor = \"0A\"\n"
      "# reference = \"0B\"\n"
      "# pointer = \"0C\"\n"
      "# its tip. To measure it: rest the tip on a point, swing the pointer about it while recording, then\n"
      "#   perimap calibrate tool --from board.mcap --output pointer.json\n"
      "# pointer_calibration = \"pointer.json\"\n";
  text += fmt::format(
      "# the camera's place in the tracked sensor and the clocks' offset. To measure them, from that recording:\n"
      "#   perimap calibrate hand-eye --from board.mcap --square-mm 8 --configuration {0}\n"
      "# hand_eye_translation_SC_mm = [0.0, 0.0, 0.0]\n"
      "# hand_eye_rotation_SC_wxyz = [1.0, 0.0, 0.0, 0.0]\n"
      "# time_offset_ms = 0.0\n"
      "# the tracker's noise. To measure it: lay the scope down and record a minute, then\n"
      "#   perimap calibrate tracker --from still.mcap --configuration {0}\n"
      "# position_deviation_mm = 0.0\n"
      "# rotation_deviation_deg = 0.0\n"
      "# error_correlation_s = 0.0\n"
      "# the tracker's frame in the patient's image. To measure it: touch the image's landmarks while recording, then\n"
      "#   perimap register --model image.csv --from landmarks.mcap --tip pointer.json --configuration {0}\n"
      "# registration_translation_IW_mm = [0.0, 0.0, 0.0]\n"
      "# registration_rotation_IW_wxyz = [1.0, 0.0, 0.0, 0.0]\n",
      file);
  return text;
}

std::string ecg_section(const SetupAnswers& answers) {
  std::string text =
      "\n[ecg]\n# what it speaks: \"cyton\", \"bitalino\", \"medlab\" or \"can\"; \"none\": there is none\n";
  text += fmt::format("protocol = {}\n", quoted(answers.ecg_protocol.empty() ? "none" : answers.ecg_protocol));
  text += "# where it is: a serial port's path, \"tcp:HOST:PORT\" or \"can:INTERFACE\"\n";
  text += set("port", answers.ecg_port, "/dev/serial/by-id/usb-FTDI");
  return text;
}

}  // namespace

std::string first_configuration(const SetupAnswers& answers, const std::string& file, const std::string& date) {
  return fmt::format(
             "# Written by perimap setup, {}. What is commented out has its default; all keys stand in the example\n"
             "# that perimap comes with. perimap check {} says whether it is sound, perimap probe {} whether the "
             "devices\n"
             "# are well, and perimap verify, before each session, whether the measured set-up still holds.\n"
             "version = 1\n\n",
             date, file, file) +
         camera_section(answers, file) + tracker_section(answers, file) + ecg_section(answers);
}

}  // namespace perimap
