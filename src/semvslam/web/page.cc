#include "semvslam/web/page.h"

#include <string_view>
#include <utility>
#include <vector>

#include "semvslam/eval/markup.h"
#include "semvslam/web/page_assets.h"
#include "semvslam/web/panel.h"
#include "semvslam/web/plan_view.h"

namespace semvslam {
namespace {

using Parts = std::vector<std::pair<std::string_view, std::string>>;

/// Puts parts in the places {{name}} of a template, in one pass: what a part holds is never looked at.
std::string filled(std::string_view page, const Parts& parts) {
  std::string out;
  while (!page.empty()) {
    const std::size_t begin = page.find("{{"), end = page.find("}}", begin);
    if (begin == std::string_view::npos || end == std::string_view::npos) break;
    out += page.substr(0, begin);
    const std::string_view name = page.substr(begin + 2, end - begin - 2);
    for (const auto& [key, content] : parts)
      if (key == name) out += content;
    page.remove_prefix(end + 2);
  }
  return out.append(page);
}

std::string all_scripts() {
  std::string out;
  for (const PageAsset& script : page_scripts()) out.append(script.text);
  return out;
}

std::string title_of(const Scene& scene) {
  std::string names;
  for (const ViewedRun& run : scene.runs) names += (names.empty() ? "" : ", ") + run.name;
  return escape_markup(names);
}

}  // namespace

std::string format_page(const Scene& scene) {
  return filled(page_template(), {{"title", title_of(scene)},
                                  {"connect", scene.live ? "'self'" : "'none'"},
                                  {"style", std::string(page_style())},
                                  {"plan", draw_plan(scene)},
                                  {"panel", format_panel(scene.runs)},
                                  {"scene", format_scene(scene)},
                                  {"script", all_scripts()}});
}

}  // namespace semvslam
