#include "semvslam/base/config_schema.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "semvslam/base/foreign_text.h"
#include "semvslam/base/yaml_limits.h"

namespace semvslam {
namespace {

template <typename T>
bool parse_number(const std::string& text, T* value) {
  const char* end = text.data() + text.size();
  const auto [stop, code] = std::from_chars(text.data(), end, *value);
  return !text.empty() && code == std::errc() && stop == end;
}

bool parse_bool(const std::string& text, bool* value) {
  *value = text == "true" || text == "yes" || text == "on";
  return *value || text == "false" || text == "no" || text == "off";
}

std::string range_to_text(const Range& range) {
  const bool low = std::isfinite(range.low), high = std::isfinite(range.high);
  if (low && high) return fmt::format("{}..{}", range.low, range.high);
  if (low) return fmt::format(">= {}", range.low);
  if (high) return fmt::format("<= {}", range.high);
  return "";
}

std::string_view last_part(std::string_view key) { return key.substr(key.rfind('.') + 1); }

std::string scalar_to_yaml(const std::string& text) {
  YAML::Emitter emitter;
  emitter << text;
  return emitter.c_str();
}

void require_good_key(std::string_view key, const void* field) {
  bool good = !key.empty() && key.front() != '.' && key.back() != '.' && field != nullptr;
  for (char c : key) good = good && ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '.');
  if (!good || key.find("..") != std::string_view::npos)
    throw std::logic_error(fmt::format("config schema: bad key {} or null field", in_quotes(key)));
}

// One scalar of a YAML document, with its dotted key.
struct Assignment {
  std::string key, value, where;
};

struct Flattener {
  const std::string& origin;
  const std::set<std::string, std::less<>>& sections;
  const std::set<std::string, std::less<>>& keys;
  std::vector<Assignment> found;
  std::string unknown_key, unknown_where;

  std::string where(const YAML::Node& node) const { return fmt::format("{}:{}", origin, node.Mark().line + 1); }

  // The path from an unknown section to its first scalar, so that the nearest known key can be a whole one.
  static std::string first_leaf(std::string path, YAML::Node node) {
    for (int depth = 0; depth < kMaxYamlNesting && node.IsMap() && node.size() > 0; ++depth) {
      const auto first = *node.begin();
      if (!first.first.IsScalar()) break;
      path += '.' + first.first.Scalar();
      node.reset(first.second);
    }
    return path;
  }

  Status visit(const YAML::Node& map, const std::string& prefix, int depth) {
    for (const auto& item : map) {
      if (!item.first.IsScalar()) return invalid_input(fmt::format("{}: keys must be plain words", where(item.first)));
      const std::string path = prefix + item.first.Scalar();
      const std::string at = where(item.first);
      if (sections.contains(path)) {
        if (item.second.IsNull()) continue;
        if (!item.second.IsMap())
          return invalid_input(fmt::format("{}: '{}' is a section: indent 'key: value' lines below it", at, path));
        if (depth >= kMaxYamlNesting) return invalid_input(fmt::format("{}: sections are nested too deeply", at));
        if (const Status status = visit(item.second, path + '.', depth + 1); !status) return status;
      } else if (!keys.contains(path)) {
        unknown_key = first_leaf(path, item.second);
        unknown_where = at;
        return invalid_input("unknown key");
      } else if (!item.second.IsScalar()) {
        return invalid_input(
            fmt::format("{}: {} needs one value, got {}", at, path,
                        item.second.IsNull() ? "none" : (item.second.IsMap() ? "a section" : "a list")));
      } else {
        found.push_back({path, item.second.Scalar(), at});
      }
    }
    return Status::success();
  }
};

}  // namespace

void ConfigSchema::add_entry(Entry entry, const void* field) {
  require_good_key(entry.key, field);
  for (const Entry& other : entries_) {
    if (other.key == entry.key || other.key.starts_with(entry.key + '.') || entry.key.starts_with(other.key + '.'))
      throw std::logic_error(fmt::format("config schema: key '{}' collides with '{}'", entry.key, other.key));
  }
  entry.default_text = entry.get();
  entries_.push_back(std::move(entry));
}

template <typename Number>
void ConfigSchema::add_number(std::string key, Number* field, Range range, std::string doc) {
  constexpr bool kWhole = std::is_integral_v<Number>;
  const auto check = [range](const std::string& text) -> Status {
    Number value = 0;
    if (!parse_number(text, &value) || !std::isfinite(static_cast<double>(value)))
      return invalid_input((kWhole ? "must be an integer, got " : "must be a number, got ") + in_quotes(text));
    if (!(value >= range.low && value <= range.high))
      return invalid_input(fmt::format("must be in {}, got {}", range_to_text(range), value));
    return Status::success();
  };
  add_entry({.key = std::move(key),
             .type = kWhole ? "integer" : "number",
             .doc = std::move(doc),
             .default_text = {},
             .range_text = range_to_text(range),
             .check = check,
             .assign = [field](const std::string& text) { parse_number(text, field); },
             .get = [field] { return fmt::format("{}", *field); }},
            field);
}

void ConfigSchema::add(std::string key, int* field, Range range, std::string doc) {
  add_number(std::move(key), field, range, std::move(doc));
}

void ConfigSchema::add(std::string key, double* field, Range range, std::string doc) {
  add_number(std::move(key), field, range, std::move(doc));
}

void ConfigSchema::add(std::string key, bool* field, std::string doc) {
  const auto check = [](const std::string& text) -> Status {
    bool value = false;
    if (!parse_bool(text, &value)) return invalid_input("must be true or false, got " + in_quotes(text));
    return Status::success();
  };
  add_entry({.key = std::move(key),
             .type = "boolean",
             .doc = std::move(doc),
             .default_text = {},
             .range_text = {},
             .check = check,
             .assign = [field](const std::string& text) { parse_bool(text, field); },
             .get = [field] { return std::string(*field ? "true" : "false"); }},
            field);
}

void ConfigSchema::add(std::string key, std::string* field, std::vector<std::string> choices, std::string doc) {
  const std::string listed = fmt::format("{}", fmt::join(choices, ", "));
  const auto check = [choices, listed](const std::string& text) -> Status {
    if (choices.empty() || std::find(choices.begin(), choices.end(), text) != choices.end()) return Status::success();
    return invalid_input(fmt::format("must be one of {}; got {}", listed, in_quotes(text)));
  };
  add_entry({.key = std::move(key),
             .type = "text",
             .doc = std::move(doc),
             .default_text = {},
             .range_text = listed,
             .check = check,
             .assign = [field](const std::string& text) { *field = text; },
             .get = [field] { return *field; }},
            field);
}

Status ConfigSchema::load_yaml(const std::string& text, const std::string& origin) {
  if (text.size() > kMaxYamlBytes) return invalid_input(origin + ": a configuration file has less than 1 MB");
  try {
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull()) return Status::success();
    if (!root.IsMap()) return invalid_input(origin + ":1: expected 'key: value' lines");

    std::set<std::string, std::less<>> known, sections;
    for (const Entry& entry : entries_) {
      known.insert(entry.key);
      for (auto dot = entry.key.find('.'); dot != std::string::npos; dot = entry.key.find('.', dot + 1))
        sections.insert(entry.key.substr(0, dot));
    }
    Flattener flat{origin, sections, known, {}, {}, {}};
    if (const Status status = flat.visit(root, "", 0); !status)
      return flat.unknown_key.empty() ? status : unknown_key(flat.unknown_key, flat.unknown_where);

    std::map<std::string, std::string> first_seen;
    for (const Assignment& a : flat.found) {
      const auto [earlier, is_new] = first_seen.emplace(a.key, a.where);
      if (!is_new)
        return invalid_input(fmt::format("{}: {} is set twice, first at {}", a.where, a.key, earlier->second));
      if (const Status status = find(a.key)->check(a.value); !status)
        return invalid_input(fmt::format("{}: {} {}", a.where, a.key, status.error().message));
    }
    for (const Assignment& a : flat.found) find(a.key)->assign(a.value);
    return Status::success();
  } catch (const YAML::Exception& e) {
    return invalid_input(fmt::format("{}:{}: not valid YAML: {}", origin, e.mark.line + 1, in_quotes(e.msg)));
  }
}

Status ConfigSchema::set(std::string_view assignment, std::string_view origin) {
  const auto equals = assignment.find('=');
  if (equals == std::string_view::npos)
    return invalid_input(fmt::format("{} needs key=value, got {}", origin, in_quotes(assignment)));
  const std::string_view key = assignment.substr(0, equals);
  const std::string value(assignment.substr(equals + 1));
  const Entry* entry = find(key);
  if (entry == nullptr) return unknown_key(key, std::string(origin));
  if (const Status status = entry->check(value); !status)
    return invalid_input(fmt::format("{}: {} {}", origin, entry->key, status.error().message));
  entry->assign(value);
  return Status::success();
}

std::string ConfigSchema::dump_yaml() const {
  // Sections in order of first appearance, even where their keys were not added together.
  std::map<std::string, std::size_t> position;
  std::vector<std::pair<std::vector<std::size_t>, const Entry*>> sorted;
  for (const Entry& entry : entries_) {
    std::vector<std::size_t> order;
    for (std::size_t dot = 0; dot != std::string::npos;) {
      dot = entry.key.find('.', dot + 1);
      order.push_back(position.emplace(entry.key.substr(0, dot), position.size()).first->second);
    }
    sorted.emplace_back(std::move(order), &entry);
  }
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first < b.first; });

  std::string out, open;  // `open`: the section that the last line was in, with its final dot
  for (const auto& [order, entry] : sorted) {
    const std::string section = entry->key.substr(0, entry->key.size() - last_part(entry->key).size());
    std::size_t from = 0, depth = 0;
    for (auto dot = section.find('.'); dot != std::string::npos; dot = section.find('.', from), ++depth) {
      if (!open.starts_with(section.substr(0, dot + 1)))
        out += fmt::format("{:{}}{}:\n", "", 2 * depth, section.substr(from, dot - from));
      from = dot + 1;
    }
    open = section;
    const std::string range = entry->range_text.empty() ? "" : " [" + entry->range_text + "]";
    out += fmt::format("{0:{1}}# {2}{3}\n{0:{1}}{4}: {5}\n", "", 2 * depth, entry->doc, range, last_part(entry->key),
                       scalar_to_yaml(entry->get()));
  }
  return out;
}

std::string ConfigSchema::markdown() const {
  std::string out = "| key | type | default | allowed | meaning |\n|---|---|---|---|---|\n";
  for (const Entry& e : entries_)
    out += fmt::format("| `{}` | {} | {} | {} | {} |\n", e.key, e.type, e.default_text, e.range_text, e.doc);
  return out;
}

std::vector<std::string> ConfigSchema::keys() const {
  std::vector<std::string> out;
  for (const Entry& entry : entries_) out.push_back(entry.key);
  return out;
}

const ConfigSchema::Entry* ConfigSchema::find(std::string_view key) const {
  for (const Entry& entry : entries_)
    if (entry.key == key) return &entry;
  return nullptr;
}

Error ConfigSchema::unknown_key(std::string_view key, const std::string& where) const {
  key = key.substr(0, 200);
  const Entry* nearest = nullptr;
  std::size_t best = std::string_view::npos;
  for (const Entry& entry : entries_) {
    // A key without (or with a wrong) section should still find its namesake: the section then counts as one edit.
    const std::size_t distance =
        std::min(edit_distance(key, entry.key), 1 + edit_distance(last_part(key), last_part(entry.key)));
    if (distance < best) best = distance, nearest = &entry;
  }
  const std::string hint = nearest == nullptr ? "" : fmt::format("; the nearest known one is '{}'", nearest->key);
  return invalid_input(fmt::format("{}: unknown key {}{}", where, in_quotes(key), hint));
}

}  // namespace semvslam
