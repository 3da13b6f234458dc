// A section of the table of configuration keys: how a key of each type is read, checked and printed.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/time/frame_rate.hpp"
#include "core/time/instant.hpp"
#include "daemon/config/configuration_keys.hpp"

namespace perimap {

inline std::optional<double> as_number(const ConfigurationValue& value) {
  if (const auto* number = std::get_if<double>(&value)) {
    return *number;
  }
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    return static_cast<double>(*integer);
  }
  return std::nullopt;
}

// A list of numbers; TOML lets integers stand among them, and an all-integer list arrives as such.
inline std::optional<std::vector<double>> as_numbers(const ConfigurationValue& value) {
  if (const auto* numbers = std::get_if<std::vector<double>>(&value)) {
    return *numbers;
  }
  if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&value)) {
    return std::vector<double>(integers->begin(), integers->end());
  }
  return std::nullopt;
}

// A list of texts; an empty list arrives as one of integers.
inline std::optional<std::vector<std::string>> as_texts(const ConfigurationValue& value) {
  if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) {
    return *texts;
  }
  const auto* none = std::get_if<std::vector<std::int64_t>>(&value);
  return none != nullptr && none->empty() ? std::optional(std::vector<std::string>()) : std::nullopt;
}

inline bool within(double value, double low, double high) {
  return std::isfinite(value) && value >= low && value <= high;
}

// Angles are given in degrees and kept in radians; 15 digits give the typed figure back.
inline double degrees_as_typed(double rad) {
  return std::strtod(fmt::format("{:.15g}", rad / kDegree).c_str(), nullptr);
}

// Collects the keys of one section. `member` says where a key's value lives, given a Configuration.
class Section {
 public:
  Section(std::string name, std::vector<ConfigurationKey>& keys) : name_(std::move(name)), keys_(keys) {}

  template <class Member>
  Section& flag(const std::string& name, Member member, const std::string& meaning) {
    return add(
        name, meaning, "true or false",
        [member](const ConfigurationValue& value, Configuration& configuration) {
          const auto* flag = std::get_if<bool>(&value);
          if (flag != nullptr) {
            member(configuration) = *flag;
          }
          return flag != nullptr;
        },
        [member](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          return member(configuration);
        });
  }

  template <class Member>
  Section& integer(const std::string& name, int low, int high, Member member, const std::string& meaning) {
    return add(
        name, meaning, fmt::format("an integer from {} to {}", low, high),
        [member, low, high](const ConfigurationValue& value, Configuration& configuration) {
          const auto* integer = std::get_if<std::int64_t>(&value);
          const bool good = integer != nullptr && *integer >= low && *integer <= high;
          if (good) {
            member(configuration) = static_cast<int>(*integer);
          }
          return good;
        },
        [member](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          return std::int64_t{member(configuration)};
        });
  }

  template <class Member>
  Section& number(const std::string& name, double low, double high, Member member, const std::string& meaning) {
    return add(
        name, meaning, fmt::format("a number from {} to {}", low, high),
        [member, low, high](const ConfigurationValue& value, Configuration& configuration) {
          const std::optional<double> number = as_number(value);
          const bool good = number && within(*number, low, high);
          if (good) {
            member(configuration) = *number;
          }
          return good;
        },
        [member](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          return member(configuration);
        });
  }

  template <class Member>
  Section& angle(const std::string& name, double low_deg, double high_deg, Member member, const std::string& meaning) {
    return add(
        name, meaning, fmt::format("a number from {} to {}", low_deg, high_deg),
        [member, low_deg, high_deg](const ConfigurationValue& value, Configuration& configuration) {
          const std::optional<double> number = as_number(value);
          const bool good = number && within(*number, low_deg, high_deg);
          if (good) {
            member(configuration) = *number * kDegree;
          }
          return good;
        },
        [member](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          return degrees_as_typed(member(configuration));
        });
  }

  // `unit` is the key's own (a millisecond, a second); low and high count it.
  template <class Member>
  Section& duration(const std::string& name, Duration unit, double low, double high, Member member,
                    const std::string& meaning) {
    const double unit_ns = static_cast<double>(unit.count());
    return add(
        name, meaning, fmt::format("a number from {} to {}", low, high),
        [member, unit_ns, low, high](const ConfigurationValue& value, Configuration& configuration) {
          const std::optional<double> number = as_number(value);
          const bool good = number && within(*number, low, high);
          if (good) {
            member(configuration) = Duration(std::llround(*number * unit_ns));
          }
          return good;
        },
        [member, unit_ns](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          return static_cast<double>(member(configuration).count()) / unit_ns;
        });
  }

  // A duration that was a count of frames once, at the usual rate.
  template <class Member>
  Section& former_frames(const std::string& name, int low, int high, Member member) {
    add(
        name, "frames at the usual rate", fmt::format("an integer from {} to {}", low, high),
        [member, low, high](const ConfigurationValue& value, Configuration& configuration) {
          const auto* frames = std::get_if<std::int64_t>(&value);
          const bool good = frames != nullptr && *frames >= low && *frames <= high;
          if (good) member(configuration) = from_seconds(static_cast<double>(*frames) / FrameRate::kUsual_per_s);
          return good;
        },
        [](const Configuration&) -> std::optional<ConfigurationValue> { return std::nullopt; });
    keys_.back().is_former = true;
    return *this;
  }

  // Any text that fits the bounded string of the published type.
  template <class Member>
  Section& text(const std::string& name, std::size_t longest, Member member, const std::string& meaning) {
    return add(
        name, meaning, fmt::format("a printable text of 1 to {} bytes", longest),
        [member, longest](const ConfigurationValue& value, Configuration& configuration) {
          const auto* text = std::get_if<std::string>(&value);
          bool good = text != nullptr && !text->empty() && text->size() <= longest;
          for (std::size_t i = 0; good && i < text->size(); ++i) {
            const auto byte = static_cast<unsigned char>((*text)[i]);
            good = byte >= 0x20 && byte != 0x7F;
          }
          if (good) {
            member(configuration) = *text;
          }
          return good;
        },
        [member](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          return member(configuration);
        });
  }

  // A text that may be left open. `valid` says whether it is one of those expected.
  template <class Member>
  Section& optional_text(const std::string& name, const std::string& expected, bool (*valid)(const std::string&),
                         Member member, const std::string& meaning) {
    return add(
        name, meaning, expected,
        [member, valid](const ConfigurationValue& value, Configuration& configuration) {
          const auto* text = std::get_if<std::string>(&value);
          const bool good = text != nullptr && valid(*text);
          if (good) {
            member(configuration) = *text;
          }
          return good;
        },
        [member](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          const std::optional<std::string>& text = member(configuration);
          return text ? std::optional<ConfigurationValue>(*text) : std::nullopt;
        });
  }

  // A list of at most `most` texts, into a vector of what a text converts to. `valid` says whether one is expected.
  template <class Member>
  Section& texts(const std::string& name, std::size_t most, const std::string& expected,
                 bool (*valid)(const std::string&), Member member, const std::string& meaning) {
    return add(
        name, meaning, fmt::format("up to {} {}", most, expected),
        [member, most, valid](const ConfigurationValue& value, Configuration& configuration) {
          const std::optional<std::vector<std::string>> texts = as_texts(value);
          if (!texts || texts->size() > most || !std::all_of(texts->begin(), texts->end(), valid)) return false;
          auto& list = member(configuration);
          list.assign(texts->begin(), texts->end());
          return true;
        },
        [member](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          const auto& list = member(configuration);
          return std::vector<std::string>(list.begin(), list.end());
        });
  }

  // A list of names of files.
  template <class Member>
  Section& files(const std::string& name, std::size_t most, Member member, const std::string& meaning) {
    constexpr auto kIsName = [](const std::string& text) {
      return !text.empty() && text.find('\0') == std::string::npos;
    };
    texts(name, most, "names of existing files", kIsName, member, meaning);
    keys_.back().names_file = true;
    return *this;
  }

  // A pose in two keys, PREFIX_translation_FRAMES_mm and PREFIX_rotation_FRAMES_wxyz.
  template <class Translation, class Rotation>
  Section& pose(const std::string& prefix, const std::string& frames, Translation translation, Rotation rotation,
                const std::string& place, const std::string& orientation) {
    numbers(
        prefix + "_translation_" + frames + "_mm", "three numbers from -10000 to 10000",
        [translation](const std::vector<double>& v, Configuration& configuration) {
          bool good = v.size() == 3;
          for (std::size_t i = 0; good && i < 3; ++i) {
            good = within(v[i], -10000, 10000);
          }
          for (std::size_t i = 0; good && i < 3; ++i) {
            translation(configuration)[i] = v[i];
          }
          return good;
        },
        [translation](const Configuration& configuration) {
          const auto& t = translation(configuration);
          return std::vector<double>{t[0], t[1], t[2]};
        },
        place);
    return numbers(
        prefix + "_rotation_" + frames + "_wxyz", "four numbers of norm 1 within 1e-3",
        [rotation](const std::vector<double>& v, Configuration& configuration) {
          if (v.size() != 4 || !within(std::hypot(std::hypot(v[0], v[1]), std::hypot(v[2], v[3])), 0.999, 1.001)) {
            return false;
          }
          for (std::size_t i = 0; i < 4; ++i) {
            rotation(configuration)[i] = v[i];
          }
          return true;
        },
        [rotation](const Configuration& configuration) {
          const auto& q = rotation(configuration);
          return std::vector<double>{q[0], q[1], q[2], q[3]};
        },
        orientation);
  }

  // A folder that must be there.
  template <class Member>
  Section& folder(const std::string& name, Member member, const std::string& meaning) {
    file(name, member, meaning);
    keys_.back().expected = "the name of an existing folder";
    keys_.back().names_folder = true;
    return *this;
  }

  template <class Member>
  Section& file(const std::string& name, Member member, const std::string& meaning) {
    add(
        name, meaning, "the name of an existing file",
        [member](const ConfigurationValue& value, Configuration& configuration) {
          const auto* text = std::get_if<std::string>(&value);
          // A NUL would end the name early when the file is opened.
          const bool good = text != nullptr && !text->empty() && text->find('\0') == std::string::npos;
          if (good) {
            member(configuration) = std::filesystem::path(*text);
          }
          return good;
        },
        [member](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          const std::optional<std::filesystem::path>& path = member(configuration);
          return path ? std::optional<ConfigurationValue>(path->string()) : std::nullopt;
        });
    keys_.back().names_file = true;
    return *this;
  }

  template <class Enum, std::size_t N, class Member>
  Section& choice(const std::string& name, const std::array<std::pair<std::string_view, Enum>, N>& choices,
                  Member member, const std::string& meaning) {
    std::string expected;
    for (const auto& [text, value] : choices) {
      expected += fmt::format("{}\"{}\"", expected.empty() ? "" : " or ", text);
    }
    return add(
        name, meaning, expected,
        [member, choices](const ConfigurationValue& value, Configuration& configuration) {
          const auto* chosen = std::get_if<std::string>(&value);
          for (const auto& [text, meant] : choices) {
            if (chosen != nullptr && *chosen == text) {
              member(configuration) = meant;
              return true;
            }
          }
          return false;
        },
        [member, choices](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          for (const auto& [text, meant] : choices) {
            if (meant == member(configuration)) {
              return std::string(text);
            }
          }
          return std::nullopt;
        });
  }

  // `accept(std::vector<double>, Configuration&)` puts the list in place or refuses it.
  template <class Accept, class Give>
  Section& numbers(const std::string& name, const std::string& expected, Accept accept, Give give,
                   const std::string& meaning) {
    return add(
        name, meaning, expected,
        [accept](const ConfigurationValue& value, Configuration& configuration) {
          const std::optional<std::vector<double>> numbers = as_numbers(value);
          return numbers && accept(*numbers, configuration);
        },
        [give](const Configuration& configuration) -> std::optional<ConfigurationValue> {
          return give(configuration);
        });
  }

  Section& add(std::string name, std::string meaning, std::string expected,
               std::function<bool(const ConfigurationValue&, Configuration&)> read,
               std::function<std::optional<ConfigurationValue>(const Configuration&)> write) {
    keys_.push_back({name_, std::move(name), std::move(meaning), std::move(expected), false, std::move(read),
                     std::move(write), false, false});
    return *this;
  }

 private:
  std::string name_;
  std::vector<ConfigurationKey>& keys_;
};

}  // namespace perimap
