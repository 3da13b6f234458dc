#include "daemon/publishing/use_text.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <string_view>

#include "daemon/publishing/wire_names.hpp"

namespace perimap {
namespace {

constexpr std::array<std::string_view, 3> kUseNames{"display", "measure", "contact"};
constexpr std::array<std::string_view, 3> kUseWords{"show", "measure", "contact"};

}  // namespace

std::optional<ToldUses> uses_of(const perimap_Surface& surface) {
  // A bound of a use is above zero.
  if (!(surface.use_within_mm[0] > 0.0)) return std::nullopt;
  const std::array<perimap_SurfaceState, 3> states{surface.display_state, surface.measure_state, surface.contact_state};
  ToldUses uses;
  for (std::size_t i = 0; i < uses.size(); ++i) {
    uses[i] = {states[i], surface.use_within_mm[i], surface.use_features[i]};
  }
  return uses;
}

std::string uses_words(const ToldUses& uses) {
  std::string words;
  for (std::size_t i = 0; i < uses.size(); ++i) {
    words += fmt::format("{}{} {} ({} within {:g} mm)", i > 0 ? ", " : "", kUseWords[i], name_of(uses[i].state),
                         uses[i].features, uses[i].within_mm);
  }
  return words;
}

nlohmann::ordered_json uses_json(const ToldUses& uses) {
  auto json = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < uses.size(); ++i) {
    json[std::string(kUseNames[i])] = {
        {"state", name_of(uses[i].state)}, {"within_mm", uses[i].within_mm}, {"features", uses[i].features}};
  }
  return json;
}

}  // namespace perimap
