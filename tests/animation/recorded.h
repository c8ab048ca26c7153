// Results that stay as they are, in tests/data/recorded/SUITE.TEST.txt. Whoever changes an algorithm on
// purpose raises its version (services/work/pipeline/algorithm_versions.h) and runs the test with
// WEFT_RECORD=1, which writes the new ones.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/counter_random.h"

namespace weft {

// Libraries choose instructions by the processor, which changes last digits.
inline constexpr double kLastDigits = 1e-7;

// The same text, with numbers that are the same but for a share of them, or of 1.
inline bool IsAsRecorded(const std::string& is, const std::string& was, double share = kLastDigits) {
  const auto begins_number = [](const char* c) {
    return std::isdigit(static_cast<unsigned char>(c[*c == '-' ? 1 : 0])) != 0;
  };
  const char *a = is.c_str(), *b = was.c_str();
  while (*a != 0 && *b != 0) {
    if (begins_number(a) && begins_number(b)) {
      char *end_a = nullptr, *end_b = nullptr;
      const double x = std::strtod(a, &end_a), y = std::strtod(b, &end_b);
      const bool is_same = std::string_view(a, end_a - a) == std::string_view(b, end_b - b);
      if (!is_same && !(std::abs(x - y) <= share * std::max(1.0, std::abs(x)))) return false;
      a = end_a, b = end_b;
    } else if (*a++ != *b++) {
      return false;
    }
  }
  return *a == *b;
}

// `name` tells several texts of a test apart.
inline void ExpectRecorded(const std::string& text, const std::string& name = "",
                           double share = kLastDigits) {
  const ::testing::TestInfo& test = *::testing::UnitTest::GetInstance()->current_test_info();
  const std::string path = std::string(WEFT_TEST_DATA "/../recorded/") + test.test_suite_name() + "." +
                           test.name() + name + ".txt";
  if (std::getenv("WEFT_RECORD") != nullptr) {
    std::ofstream(path) << text;
    return;
  }
  std::ifstream file(path);
  const std::string was(std::istreambuf_iterator<char>(file), {});
  EXPECT_TRUE(IsAsRecorded(text, was, share)) << path << " does not hold\n" << text;
}

// Numbers of large tables, a line for each.
class Recorded {
 public:
  void Add(const std::string& name, double value) { text_ << value << " " << name << "\n"; }
  // A sum with random weights: it changes with every entry, and with their order and number.
  template <typename T>
  void Add(const std::string& name, const std::vector<T>& table) {
    double sum = static_cast<double>(table.size());
    uint64_t at = 0;
    for (const auto& entry : table) Mix(entry, at, sum);
    Add(name, sum);
  }
  template <typename Derived>
  void Add(const std::string& name, const Eigen::MatrixBase<Derived>& table) {
    double sum = static_cast<double>(table.rows());
    uint64_t at = 0;
    Mix(table, at, sum);
    Add(name, sum);
  }
  void Expect(double share = kLastDigits) const { ExpectRecorded(text_.str(), "", share); }

  Recorded() { text_.precision(10); }

 private:
  static void Mix(double value, uint64_t& at, double& sum) { sum += NormalOf(5, at++) * value; }
  template <typename Derived>
  static void Mix(const Eigen::MatrixBase<Derived>& entry, uint64_t& at, double& sum) {
    for (Eigen::Index c = 0; c < entry.cols(); ++c)
      for (Eigen::Index r = 0; r < entry.rows(); ++r) Mix(static_cast<double>(entry(r, c)), at, sum);
  }
  static void Mix(const Eigen::Isometry3d& entry, uint64_t& at, double& sum) { Mix(entry.matrix(), at, sum); }
  static void Mix(const std::pair<int, int>& entry, uint64_t& at, double& sum) {
    Mix(static_cast<double>(entry.first), at, sum);
    Mix(static_cast<double>(entry.second), at, sum);
  }

  std::ostringstream text_;
};

}  // namespace weft
