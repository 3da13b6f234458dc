#include "daemon/pages/html_page.hpp"

#include <fmt/format.h>

namespace perimap {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\n"
      "<style>body{{font-family:sans-serif;margin:2em;max-width:1700px}}table{{border-collapse:collapse}}"
      "td,th{{padding:.3em .9em;border-bottom:1px solid #ddd;text-align:right}}td:first-child,th:first-child"
      "{{text-align:left}}svg{{max-width:100%;height:auto}}</style></head>\n<body><h1>{0}</h1>\n{1}</body></html>\n",
      escaped(title), body);
}

}  // namespace perimap
