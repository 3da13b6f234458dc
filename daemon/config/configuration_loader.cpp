#include "daemon/config/configuration_loader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <system_error>
#include <utility>
#include <vector>

#include "core/error/nearest_name.hpp"
#include "core/pipeline/release_schedule.hpp"
#include "daemon/config/configuration_keys.hpp"
#include "daemon/config/ecg_inputs.hpp"
#include "daemon/config/session_keys.hpp"
#include "daemon/config/surface_traffic.hpp"
#include "drivers/text_file/text_file.hpp"
#include "drivers/toml/toml_text.hpp"
#include "drivers/toml/wrong_toml_keys.hpp"

namespace perimap {
namespace {

// Where a text comes from: from whoever runs perimap, who may say all; or along with a recording, which may say of its
// session alone. What else one says is refused, or passed over.
enum class Source { kFile, kRecording, kRecordingPassedOver };

std::string full_name(std::string_view section, std::string_view key) {
  return section.empty() ? std::string(key) : fmt::format("{}.{}", section, key);
}

// The node as one of the types that keys can have; none for all others.
std::optional<ConfigurationValue> value_of(const toml::node& node) {
  if (const auto* flag = node.as_boolean()) {
    return flag->get();
  }
  if (const auto* integer = node.as_integer()) {
    return integer->get();
  }
  if (const auto* number = node.as_floating_point()) {
    return number->get();
  }
  if (const auto* text = node.as_string()) {
    return text->get();
  }
  const toml::array* array = node.as_array();
  if (array == nullptr) {
    return std::nullopt;
  }
  if (!array->empty() && array->is_homogeneous<std::string>()) {
    std::vector<std::string> texts;
    for (const toml::node& element : *array) texts.push_back(element.as_string()->get());
    return texts;
  }
  std::vector<std::int64_t> integers;
  std::vector<double> numbers;
  for (const toml::node& element : *array) {
    if (const auto* integer = element.as_integer()) {
      integers.push_back(integer->get());
      numbers.push_back(static_cast<double>(integer->get()));
    } else if (const auto* number = element.as_floating_point()) {
      numbers.push_back(number->get());
    } else {
      return std::nullopt;
    }
  }
  if (integers.size() == numbers.size()) {
    return integers;
  }
  return numbers;
}

// Walks one parsed file, keeps what is good and remembers what is wrong.
class Overlay {
 public:
  Overlay(const std::filesystem::path& file, const Configuration& base, NamedFiles named_files, Source source)
      : file_(file), named_files_(named_files), source_(source), configuration_(base) {}

  Expected<Configuration> apply(const toml::table& root) {
    for (const auto& [key, node] : root) {
      if (find("", key.str()) != nullptr) {
        read("", key, node);
      } else if (!section_exists(key.str())) {
        refuse_unknown("", key);
      } else if (const toml::table* section = node.as_table()) {
        for (const auto& [name, value] : *section) {
          read(key.str(), name, value);
        }
      } else {
        refuse(node.source().begin, key.str(), "a table", describe(node));
        untold_.emplace_back(key.str());
      }
    }
    if (!root.contains("version")) {
      refuse({1, 1}, "version", find("", "version")->expected, "nothing");
    }
    check_budget(root);
    check_frames_underway(root);
    check_inputs(root);
    check_traffic(root);
    if (!wrong_.empty()) return tl::unexpected(wrong_.told());
    return configuration_;
  }

  // The keys that a recording may not set, and that were passed over.
  [[nodiscard]] std::vector<Error> passed_over() const { return passed_over_.each(); }

 private:
  static const ConfigurationKey* find(std::string_view section, std::string_view name) {
    for (const ConfigurationKey& key : configuration_keys()) {
      if (key.section == section && key.name == name) {
        return &key;
      }
    }
    return nullptr;
  }

  static bool section_exists(std::string_view section) {
    for (const ConfigurationKey& key : configuration_keys()) {
      if (!key.section.empty() && key.section == section) {
        return true;
      }
    }
    return false;
  }

  void read(std::string_view section, const toml::key& name, const toml::node& node) {
    const ConfigurationKey* key = find(section, name.str());
    if (key == nullptr) {
      refuse_unknown(section, name);
      return;
    }
    if (source_ != Source::kFile && !describes_session(*key)) {
      refuse_of_recording(full_name(section, name.str()), name);
      return;
    }
    std::optional<ConfigurationValue> value = value_of(node);
    if (value && key->names_file) {
      if (const auto wrong = place_files(*key, *value)) {
        refuse(node.source().begin, full_name(section, name.str()), key->expected,
               fmt::format("{} ({})", describe(node), *wrong));
        untold_.push_back(full_name(section, name.str()));
        return;
      }
    }
    if (!value || !key->read(*value, configuration_)) {
      refuse(node.source().begin, full_name(section, name.str()), key->expected, describe(node));
      untold_.push_back(full_name(section, name.str()));
    }
  }

  // Names of files as paths from this file's folder; what is wrong with one of them.
  [[nodiscard]] std::optional<std::string> place_files(const ConfigurationKey& key, ConfigurationValue& value) const {
    std::vector<std::string*> names;
    if (auto* name = std::get_if<std::string>(&value)) names.push_back(name);
    if (auto* list = std::get_if<std::vector<std::string>>(&value)) {
      for (std::string& name : *list) names.push_back(&name);
    }
    for (std::string* name : names) {
      std::error_code code;
      const std::filesystem::path folder = std::filesystem::absolute(file_, code).parent_path();
      const std::filesystem::path path = (folder / *name).lexically_normal();
      const bool there =
          key.names_folder ? std::filesystem::is_directory(path, code) : std::filesystem::is_regular_file(path, code);
      if (named_files_ == NamedFiles::kMustExist && !there) {
        return fmt::format("{} is {}", path.string(),
                           !std::filesystem::exists(path, code) ? "not there"
                           : key.names_folder                   ? "not a folder"
                                                                : "not a file");
      }
      // An empty name stays empty, so that the key refuses it.
      if (!name->empty()) *name = path.string();
    }
    return std::nullopt;
  }

  void refuse_unknown(std::string_view section, const toml::key& name) {
    std::vector<std::string_view> known;
    std::string elsewhere;
    for (const ConfigurationKey& key : configuration_keys()) {
      if (key.is_former) continue;
      const std::string_view candidate = section.empty() && !key.section.empty() ? key.section : key.name;
      if ((section.empty() || key.section == section) && (known.empty() || candidate != known.back())) {
        known.push_back(candidate);
      }
      if (elsewhere.empty() && key.name == name.str()) elsewhere = full_name(key.section, key.name);
    }
    // One that stands in the wrong section is not misspelt.
    const std::string meant =
        elsewhere.empty() ? did_you_mean(name.str(), known) : fmt::format("; did you mean '{}'?", elsewhere);
    refuse(name.source().begin, full_name(section, name.str()), fmt::format("one of {}", fmt::join(known, ", ")),
           "an unknown key" + meant);
    untold_.emplace_back(section);  // it may stand for any of them
  }

  void refuse_of_recording(const std::string& key, const toml::key& name) {
    WrongTomlKeys& wrong = source_ == Source::kRecordingPassedOver ? passed_over_ : wrong_;
    wrong.add(name.source().begin, key, "of a recording what describes its session, and nothing else",
              "a key that only a configuration file may set (perimap replay --whole passes over it)");
  }

  // Where the file has the first of these keys, as "section.name"; its beginning when it has none.
  static toml::source_position place_of(const toml::table& root, std::initializer_list<std::string_view> keys) {
    for (const std::string_view key : keys) {
      if (const toml::node* node = toml::at_path(root, key).node()) return node->source().begin;
    }
    return {1, 1};
  }

  // Whether values go together can be told of good values alone: none of these keys was refused, nor stands what may be
  // one of them misspelt where it would.
  [[nodiscard]] bool are_good(std::initializer_list<std::string_view> keys) const {
    return std::none_of(untold_.begin(), untold_.end(), [&](const std::string& untold) {
      return std::any_of(keys.begin(), keys.end(), [&](std::string_view key) {
        return untold.empty() || key == untold || key.substr(0, key.find('.')) == untold;
      });
    });
  }

  // Without a latency longer than the budget no release can be on time.
  void check_budget(const toml::table& root) {
    if (!are_good({"pipeline.budget_ms", "pipeline.latency_ms"})) return;
    const PipelineConfiguration& pipeline = configuration_.pipeline;
    if (pipeline.budget < pipeline.latency) {
      return;
    }
    refuse(place_of(root, {"pipeline.budget_ms", "pipeline.latency_ms"}), "pipeline.budget_ms",
           fmt::format("less than latency_ms ({:.6g})", to_seconds(pipeline.latency) * 1e3),
           fmt::format("{:.6g}", to_seconds(pipeline.budget) * 1e3));
  }

  // What is between capture and release is kept for so many frames.
  void check_frames_underway(const toml::table& root) {
    if (!are_good({"pipeline.latency_ms", "camera.frame_rate_hz"})) return;
    const double rate_hz = configuration_.camera.frame_rate_hz;
    const double latency_s = to_seconds(configuration_.pipeline.latency);
    if (latency_s * rate_hz <= kMostFramesUnderway) return;
    refuse(place_of(root, {"pipeline.latency_ms", "camera.frame_rate_hz"}), "pipeline.latency_ms",
           fmt::format("at most {:.6g} at camera.frame_rate_hz = {:.6g} ({} frames between capture and release)",
                       std::floor(kMostFramesUnderway * 1e4 / rate_hz) / 10, rate_hz, kMostFramesUnderway),
           fmt::format("{:.6g}", latency_s * 1e3));
  }

  // What an ECG device has no input for is refused where it is asked for, or else where the device is named.
  void check_inputs(const toml::table& root) {
    if (!are_good({"ecg.protocol", "ecg.port", "ecg.channel", "ecg.second_channel", "ecg.r_trigger",
                   "ecg.r_trigger_port", "respiration.device_channel"})) {
      return;
    }
    for (const WrongInput& wrong : wrong_inputs(configuration_)) {
      toml::source_position where{1, 1};
      for (const toml::node* node : {root["ecg"]["protocol"].node(), root[wrong.section][wrong.key].node()}) {
        if (node != nullptr) where = node->source().begin;
      }
      refuse(where, full_name(wrong.section, wrong.key), wrong.expected, wrong.got);
    }
  }

  // What is to be published must fit: a network that is flooded loses samples of all streams, and nobody chose which.
  void check_traffic(const toml::table& root) {
    if (!are_good({"pipeline.release", "pipeline.clock_rate_hz", "features.maximum", "camera.frame_rate_hz",
                   "estimation.harmonics", "respiration.enabled", "dds.maximum_MB_per_s"})) {
      return;
    }
    const SurfaceTraffic traffic = surface_traffic(configuration_);
    const double most_MB_per_s = configuration_.dds.maximum_MB_per_s;
    if (traffic.MB_per_s() <= most_MB_per_s) return;
    const bool clock = traffic.clock_rate_hz > 0.0;
    const int features = most_features(configuration_);
    std::string fits = fmt::format("features.maximum of at most {}", features);
    if (const double rate_hz = highest_clock_rate_hz(configuration_); clock && rate_hz >= 1.0) {
      fits = fmt::format("at most {:.6g}, or {}", rate_hz, fits);
    }
    const std::string got =
        fmt::format("{:.6g} MB/s of surfaces with {} features, {:.6g} of them a second, and their models",
                    traffic.MB_per_s(), configuration_.features.maximum, traffic.clock_rate_hz + traffic.frame_rate_hz);
    const std::string_view key = clock ? "pipeline.clock_rate_hz" : "features.maximum";
    refuse(
        place_of(root, {key, "pipeline.release", "features.maximum", "camera.frame_rate_hz", "dds.maximum_MB_per_s"}),
        key, fmt::format("what dds.maximum_MB_per_s = {:.6g} allows ({})", most_MB_per_s, fits), got);
  }

  void refuse(toml::source_position where, std::string_view key, std::string_view expected, std::string_view got) {
    wrong_.add(where, key, expected, got);
  }

  const std::filesystem::path& file_;
  NamedFiles named_files_;
  Source source_;
  Configuration configuration_;
  WrongTomlKeys wrong_{file_.string()};
  WrongTomlKeys passed_over_{file_.string()};
  std::vector<std::string> untold_;  // keys that were refused, and sections (empty: all) with what is no key
};

Expected<RecordedConfiguration> parse(std::string_view text, const std::filesystem::path& file,
                                      const Configuration& base, NamedFiles named_files, Source source) {
  const auto root = parse_toml(text, file);
  if (!root) return tl::unexpected(root.error());
  Overlay overlay(file, base, named_files, source);
  auto configuration = overlay.apply(*root);
  if (!configuration) return tl::unexpected(std::move(configuration.error()));
  return RecordedConfiguration{std::move(*configuration), overlay.passed_over()};
}

}  // namespace

Expected<Configuration> parse_configuration(std::string_view text, const std::filesystem::path& file,
                                            const Configuration& base, NamedFiles named_files) {
  return parse(text, file, base, named_files, Source::kFile).map([](RecordedConfiguration read) {
    return std::move(read.configuration);
  });
}

Expected<RecordedConfiguration> parse_recorded_configuration(std::string_view text, const std::string& name,
                                                             const Configuration& base, OtherKeys others) {
  return parse(text, name, base, NamedFiles::kMayBeMissing,
               others == OtherKeys::kRefused ? Source::kRecording : Source::kRecordingPassedOver);
}

Expected<Configuration> load_configuration(const std::filesystem::path& file, const Configuration& base,
                                           NamedFiles named_files) {
  const Expected<std::string> text = read_text_file(file, kLargestToml, "configuration file");
  if (!text) return tl::unexpected(text.error());
  return parse_configuration(*text, file, base, named_files);
}

}  // namespace perimap
