#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace repose::tools::check {

/// A table of numbers that were stored and what they come to when computed again.
class Comparison {
 public:
  /// Two numbers agree if they differ by at most `tolerance` times a scale given with them.
  explicit Comparison(double tolerance) : tolerance_(tolerance) {}

  /// Rows added from here on belong to `section` (e.g. "step 0003").
  void begin(const std::string& section);
  /// `scale`: what the difference is measured against; 0: they must be equal. Not finite: never
  /// agrees.
  void number(const std::string& name, double stored, double recomputed, double scale);
  /// Compares every entry of two arrays; the table shows the worst. Arrays of different length
  /// disagree.
  void array(const std::string& name, std::span<const double> stored,
             std::span<const double> recomputed, double scale);
  /// Checks a number that cannot be recomputed: within [least, most], and not NaN. The table says
  /// "range only".
  void range(const std::string& name, double stored, double minimum, double maximum);
  /// A statement about the file that holds or does not.
  void statement(const std::string& text, bool holds);
  /// Adds numbers that cannot be checked.
  void unchecked(const std::string& name, int64_t numbers) { unchecked_[name] += numbers; }

  double tolerance() const { return tolerance_; }
  int64_t compared() const { return compared_; }
  int64_t disagreeing() const { return disagreeing_; }
  /// The row with the largest difference among those that disagree, in words; empty if none does.
  std::string worst() const;
  /// One line a row: section, name, stored, recomputed, relative difference, verdict.
  std::string table() const;
  /// One line for each name that was recomputed, of its worst row in any section, with the number
  /// of entries that it stands for; one line for all ranges and one for all statements, and those
  /// that do not hold; one line for each name of which numbers were not checked.
  std::string summary() const;

 private:
  struct Row {
    std::string section, name;
    double stored = 0, recomputed = 0, difference = 0;
    int64_t entries = 1, wrong = 0;
    enum Kind { recalculated, range_only, stated } kind = recalculated;
  };
  static double relative(double stored, double recomputed, double scale);
  void add(Row row);
  static std::string line(const Row& row);
  static std::string verdict(const Row& row);
  std::vector<Row> by_name() const;
  std::string others(Row::Kind kind, const std::string& what) const;

  double tolerance_;
  std::string section_;
  std::vector<Row> rows_;
  std::map<std::string, int64_t> unchecked_;
  int64_t compared_ = 0, disagreeing_ = 0;
};

}  // namespace repose::tools::check
