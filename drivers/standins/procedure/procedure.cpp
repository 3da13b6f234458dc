#include "drivers/standins/procedure/procedure.hpp"

#include <fmt/format.h>

#include "drivers/standins/procedure/procedure_keys.hpp"
#include "drivers/standins/procedure/procedure_text.hpp"

namespace perimap {

std::string_view kind_of(const Happening& what) noexcept { return kEventKinds[what.index()]; }

const std::vector<std::string_view>& kinds_of_events() {
  static const std::vector<std::string_view> kinds(kEventKinds.begin(), kEventKinds.end());
  return kinds;
}

std::string words_of(const ProcedureEvent& event) {
  std::string words(kind_of(event.what));
  std::visit(
      [&words](const auto& what) {
        const char* between = ": ";
        visit_keys(what, [&](const ProcedureKey& key, const auto& value) {
          words += fmt::format("{}{} = {}", between, key.name, value_text(value));
          between = ", ";
        });
      },
      event.what);
  return words;
}

bool hides_the_organ(const Happening& what) noexcept {
  constexpr double kDense = 1.0;  // what is left of the contrast is less than 37 %
  constexpr double kHalf = 0.5;   // of the picture
  if (std::holds_alternative<Withdrawn>(what) || std::holds_alternative<Wiped>(what)) return true;
  if (const auto* fog = std::get_if<Fogged>(&what)) return fog->density >= kDense;
  if (const auto* smoke = std::get_if<Smoke>(&what)) return smoke->density >= kDense;
  if (const auto* blood = std::get_if<Blood>(&what)) return blood->share >= kHalf;
  return false;
}

}  // namespace perimap
