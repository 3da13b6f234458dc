// true_overlay_check ADDRESS RECORDING SAMPLES: what `perimap view RECORDING --samples SAMPLES` at that address has its
// page draw over each picture, against where the simulated heart truly was in that picture, seen from where the camera
// truly was. Exit code 1 where half of the positions are further off than a pixel.
#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/integration/example/true_places.hpp"

namespace perimap {
namespace {

using nlohmann::json;
using test::PublishedPlaces;

// As the page does: asks for instants, and gets what to show.
class PageConnection {
 public:
  explicit PageConnection(const std::string& address) {
    const std::string prefix = "http://127.0.0.1:";
    if (!address.starts_with(prefix)) throw std::runtime_error(address + ": is no address of a page");
    const std::string port = address.substr(prefix.size(), address.find('/', prefix.size()) - prefix.size());
    socket_.next_layer().connect(
        {boost::asio::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(std::stoi(port))});
    socket_.read_message_max(std::size_t{64} << 20U);
    socket_.handshake("127.0.0.1:" + port, "/live");
  }

  // The next that is text; pictures are passed over.
  [[nodiscard]] json next() {
    for (;;) {
      boost::beast::flat_buffer buffer;
      socket_.read(buffer);
      if (socket_.got_text()) return json::parse(boost::beast::buffers_to_string(buffer.data()));
    }
  }
  // What is shown at an instant of the recording's time line, in the order in which it is told.
  [[nodiscard]] json at(double at_s) {
    socket_.text(true);
    socket_.write(boost::asio::buffer(json{{"at_s", at_s}}.dump()));
    for (json message = next();; message = next()) {
      if (message["kind"] == "moment") return message["messages"];
    }
  }

 private:
  boost::asio::io_context io_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> socket_{io_};
};

struct OffPx {
  std::vector<double> all, converged;
  std::map<std::uint64_t, int> pictures;  // that were judged
};

void judge_overlay(const json& overlay, const RecordedTruth& truth, const PublishedPlaces& published, OffPx& off) {
  constexpr int kConverged = 2;
  const json& drawn = overlay["drawn"];
  const auto frame = overlay["frame"].get<std::uint64_t>();
  if (drawn.is_null() || !off.pictures.emplace(frame, 1).second) return;
  const Instant capture = truth.captures.at(frame);
  const auto X_WC = truth.truth.camera_pose(capture);
  if (!X_WC) throw std::runtime_error("no true pose of a picture");
  const json &px = drawn["features_px"], &ids = drawn["feature_ids"], &states = drawn["feature_states"];
  if (px.size() != 2 * ids.size() || ids.size() != states.size())
    throw std::runtime_error("lists of different lengths");
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto there = test::true_pixel(truth, published, ids[i].get<std::uint32_t>(), capture, *X_WC);
    if (!there) continue;
    off.all.push_back((*there - Vector2d(px[2 * i].get<double>(), px[2 * i + 1].get<double>())).norm());
    if (states[i] == kConverged) off.converged.push_back(off.all.back());
  }
}

double share(std::vector<double>& values, double part) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(part * static_cast<double>(values.size() - 1)));
}

int judge(const std::string& address, const std::string& recording, const std::string& samples) {
  const RecordedTruth truth = test::truth_of(recording);
  const PublishedPlaces published = test::read_published_places(samples, truth);
  PageConnection page(address);
  const json hello = page.next();
  if (hello["kind"] != "hello" || !hello["pictures"].get<bool>()) throw std::runtime_error("a page without pictures");
  OffPx off;
  for (double at_s = 0.0; at_s < hello["length_s"].get<double>(); at_s += 0.1) {
    for (const json& message : page.at(at_s)) {
      if (message["kind"] == "overlay") judge_overlay(message, truth, published, off);
    }
  }
  if (off.converged.size() < 500)
    throw std::runtime_error(fmt::format("only {} converged features were drawn", off.converged.size()));
  const double median = share(off.all, 0.5);
  fmt::print(
      "{} positions in {} pictures, off by {:.2f} px (median), {:.2f} px (95 %); the {} of converged features by "
      "{:.2f} "
      "and {:.2f} px\n",
      off.all.size(), off.pictures.size(), median, share(off.all, 0.95), off.converged.size(),
      share(off.converged, 0.5), share(off.converged, 0.95));
  return median <= 1.0 ? 0 : 1;
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  try {
    if (argc == 4) return perimap::judge(argv[1], argv[2], argv[3]);
    std::fputs("usage: true_overlay_check ADDRESS RECORDING SAMPLES\n", stderr);
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "true_overlay_check: %s\n", error.what());
    return 1;
  }
}
