#include "repose/tools/check/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace repose::tools::check {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

}  // namespace

void Comparison::begin(const std::string& section) { section_ = section; }

double Comparison::relative(double stored, double recomputed, double scale) {
  if (!std::isfinite(stored) || !std::isfinite(recomputed)) return infinite;
  if (stored == recomputed) return 0;
  return scale > 0 ? std::abs(stored - recomputed) / scale : infinite;
}

void Comparison::add(Row row) {
  row.section = section_;
  compared_ += row.entries;
  disagreeing_ += row.wrong;
  rows_.push_back(std::move(row));
}

void Comparison::number(const std::string& name, double stored, double recomputed, double scale) {
  array(name, {&stored, 1}, {&recomputed, 1}, scale);
}

void Comparison::array(const std::string& name, std::span<const double> stored,
                       std::span<const double> recomputed, double scale) {
  Row row;
  row.name = name;
  row.entries = std::ssize(stored);
  if (stored.size() != recomputed.size()) {
    row.difference = infinite;
    row.wrong = row.entries = std::max<int64_t>(row.entries, 1);
    return add(row);
  }
  double worst = -1;
  for (size_t i = 0; i < stored.size(); ++i) {
    const double difference = relative(stored[i], recomputed[i], scale);
    row.wrong += !(difference <= tolerance_);
    if (difference <= worst) continue;
    worst = difference;
    row.stored = stored[i];
    row.recomputed = recomputed[i];
    row.difference = difference;
  }
  add(row);
}

void Comparison::range(const std::string& name, double stored, double minimum, double maximum) {
  Row row;
  row.name = name;
  row.stored = stored;
  row.kind = Row::range_only;
  row.wrong = !(stored >= minimum && stored <= maximum);
  row.difference = row.wrong > 0 ? infinite : 0;
  add(row);
}

void Comparison::statement(const std::string& text, bool holds) {
  Row row;
  row.name = text;
  row.kind = Row::stated;
  row.wrong = !holds;
  row.difference = holds ? 0 : infinite;
  add(row);
}

std::string Comparison::worst() const {
  const Row* worst = nullptr;
  for (const Row& row : rows_)
    if (row.wrong > 0 && (!worst || row.difference > worst->difference)) worst = &row;
  if (!worst) return "";
  if (worst->kind == Row::stated) return fmt::format("{}: not so: {}", worst->section, worst->name);
  if (worst->kind == Row::range_only)
    return fmt::format("{} {}: stored {:.10g} is out of range", worst->section, worst->name,
                       worst->stored);
  return fmt::format("{} {}: stored {:.10g}, recomputed {:.10g}", worst->section, worst->name,
                     worst->stored, worst->recomputed);
}

std::string Comparison::verdict(const Row& row) {
  return row.wrong == 0 ? "agrees" : fmt::format("{} of {} DISAGREE", row.wrong, row.entries);
}

std::string Comparison::line(const Row& row) {
  if (row.kind == Row::stated)
    return fmt::format("{:10} {:75} {}\n", row.section, row.name, row.wrong ? "NOT SO" : "holds");
  if (row.kind == Row::range_only)
    return fmt::format("{:10} {:25} {:>17.10g} {:>17} {:>13} {}\n", row.section, row.name,
                       row.stored, "range only", "", row.wrong ? "OUT OF RANGE" : "in range");
  return fmt::format("{:10} {:25} {:>17.10g} {:>17.10g} {:>13.1e} {}\n", row.section, row.name,
                     row.stored, row.recomputed, row.difference, verdict(row));
}

std::string Comparison::table() const {
  std::string text = fmt::format("{:10} {:25} {:>17} {:>17} {:>13}\n", "", "quantity", "stored",
                                 "recomputed", "rel. diff.");
  for (const Row& row : rows_) text += line(row);
  return text;
}

std::vector<Comparison::Row> Comparison::by_name() const {
  std::vector<Row> kinds;
  for (const Row& row : rows_) {
    if (row.kind != Row::recalculated) continue;
    const auto same = std::ranges::find(kinds, row.name, &Row::name);
    if (same == kinds.end()) {
      kinds.push_back(row);
      continue;
    }
    const int64_t entries = same->entries + row.entries, wrong = same->wrong + row.wrong;
    if (row.difference > same->difference) *same = row;
    same->entries = entries;
    same->wrong = wrong;
  }
  return kinds;
}

std::string Comparison::others(Row::Kind kind, const std::string& what) const {
  int64_t all = 0, wrong = 0;
  std::string text;
  for (const Row& row : rows_) {
    if (row.kind != kind) continue;
    ++all;
    wrong += row.wrong;
    if (row.wrong > 0) text += line(row);
  }
  return fmt::format("{:25} {:>10}{}\n", what, all - wrong,
                     wrong > 0 ? fmt::format(", {} DO NOT", wrong) : "") +
         text;
}

std::string Comparison::summary() const {
  std::string text = fmt::format("{:25} {:>10} {:>17} {:>17} {:>11}  {:10}\n", "quantity",
                                 "entries", "stored", "recomputed", "rel. diff.", "at worst in");
  for (const Row& row : by_name())
    text += fmt::format("{:25} {:>10} {:>17.10g} {:>17.10g} {:>11.1e}  {:10} {}\n", row.name,
                        row.entries, row.stored, row.recomputed, row.difference, row.section,
                        verdict(row));
  text += others(Row::range_only, "ranges that hold") + others(Row::stated, "statements that hold");
  for (const auto& [name, numbers] : unchecked_)
    if (numbers > 0) text += fmt::format("{:25} {:>10}  NOT CHECKED\n", name, numbers);
  return text;
}

}  // namespace repose::tools::check
