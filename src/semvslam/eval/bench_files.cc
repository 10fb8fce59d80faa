#include "semvslam/eval/bench_files.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "semvslam/eval/bench_tables.h"

namespace semvslam {
namespace {

using Json = nlohmann::ordered_json;

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + '"';
}

Json numbers_of(const BenchRun& run) {
  Json json = Json::object();
  for (const BenchNumber& number : bench_numbers())
    if (const auto value = number.of(run)) json[std::string(number.name)] = *value;
  return json;
}

Json run_to_json(const BenchRun& run) {
  Json json = {{"sequence", run.sequence}, {"mode", run.mode}, {"run", run.number}, {"folder", run.folder}};
  if (run.failure.empty())
    json["numbers"] = numbers_of(run);
  else
    json["failure"] = run.failure;
  return json;
}

Json cell_to_json(const BenchCell& cell) {
  Json numbers = Json::object();
  for (const BenchNumber& number : bench_numbers())
    if (const Spread s = cell.over(number); s.count > 0)
      numbers[std::string(number.name)] = {{"median", s.median}, {"min", s.min}, {"max", s.max}};
  return {{"sequence", cell.sequence},
          {"mode", cell.mode},
          {"runs", cell.good.size() + cell.failed.size()},
          {"failed", cell.failed.size()},
          {"numbers", numbers}};
}

}  // namespace

std::string to_csv(const BenchResults& results) {
  std::string out = "sequence,mode,run,failure";
  for (const BenchNumber& number : bench_numbers()) out += fmt::format(",{}", number.name);
  out += '\n';
  for (const BenchRun& run : results.runs) {
    out += fmt::format("{},{},{},{}", csv_cell(run.sequence), csv_cell(run.mode), run.number, csv_cell(run.failure));
    for (const BenchNumber& number : bench_numbers()) {
      const auto value = run.failure.empty() ? number.of(run) : std::nullopt;
      out += value ? fmt::format(",{}", *value) : ",";
    }
    out += '\n';
  }
  return out;
}

std::string to_json(const BenchResults& results) {
  Json facts = Json::object(), runs = Json::array(), cells = Json::array();
  for (const auto& [name, value] : results.facts) facts[name] = value;
  for (const BenchRun& run : results.runs) runs.push_back(run_to_json(run));
  for (const BenchCell& cell : cells_of(results)) cells.push_back(cell_to_json(cell));
  const Json json = {{"bench", results.name},
                     {"facts", facts},
                     {"baseline", results.baseline},
                     {"rpe_delta", results.rpe_delta},
                     {"remarks", results.remarks},
                     {"broken_limits", results.broken_limits},
                     {"summary", cells},
                     {"runs", runs}};
  // Names need not be UTF-8: a byte that is none becomes a replacement character instead of an exception.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string to_markdown(const BenchResults& results) {
  Table facts;
  facts.title = "Bench " + results.name;
  facts.columns = {"", ""};
  facts.text_columns = 2;
  for (const auto& [name, value] : results.facts) facts.rows.push_back({name, value});
  for (const std::string& remark : results.remarks) facts.rows.push_back({"remark", remark});
  std::string out = to_markdown(facts);
  for (const Table& table : bench_tables(results)) out += to_markdown(table);
  return out;
}

}  // namespace semvslam
