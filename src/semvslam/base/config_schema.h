#pragma once

#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

/// Closed interval of allowed values.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

/// The one description of every configuration value: key, type, default, allowed values, meaning. Bound to the fields
/// of option structs; loading, `--set`, the effective config file, the help text and the documentation page come from
/// it. The default of a key is what its field holds when it is added.
class ConfigSchema {
 public:
  /// @param key dotted, lower case: "orb.features". @param doc one line, with the unit.
  void add(std::string key, int* field, Range range, std::string doc);
  void add(std::string key, double* field, Range range, std::string doc);
  void add(std::string key, bool* field, std::string doc);
  /// @param choices empty = any text.
  void add(std::string key, std::string* field, std::vector<std::string> choices, std::string doc);

  /// Sets values from nested YAML. An unknown key, a wrong type or a value out of range is an Error that names the
  /// origin, the line, the key and, for unknown keys, the nearest known one. Nothing is changed on error.
  Status load_yaml(const std::string& text, const std::string& origin);
  /// Sets one value from "key=value". @param origin the command's option, for messages
  Status set(std::string_view assignment, std::string_view origin = "--set");
  /// All keys with their present values as YAML, each with its doc line as a comment.
  std::string dump_yaml() const;
  /// A Markdown table: key, type, default, range, meaning.
  std::string markdown() const;
  std::vector<std::string> keys() const;

 private:
  struct Entry {
    std::string key, type, doc, default_text, range_text;
    std::function<Status(const std::string&)> check;  // of the text of a value
    std::function<void(const std::string&)> assign;   // after check
    std::function<std::string()> get;
  };
  template <typename Number>
  void add_number(std::string key, Number* field, Range range, std::string doc);
  void add_entry(Entry entry, const void* field);
  const Entry* find(std::string_view key) const;
  Error unknown_key(std::string_view key, const std::string& where) const;
  std::vector<Entry> entries_;
};

}  // namespace semvslam
