#include "evaluation/error_tally.h"

#include <algorithm>
#include <bit>

namespace weft {
namespace {

// Bins are the leading bits of a float: its exponent and nine bits of its mantissa, 512 bins an octave.
constexpr int kDroppedBits = 23 - 9;
constexpr float kLeast = 0x1p-30F, kGreatest = 0x1p20F;  // errors below and beyond share the outer bins

uint32_t LeadingBits(float value) { return std::bit_cast<uint32_t>(value) >> kDroppedBits; }

size_t BinOf(double error) {
  const auto value = static_cast<float>(error);
  if (!(value >= kLeast)) return 0;
  return 1 + LeadingBits(std::min(value, kGreatest)) - LeadingBits(kLeast);
}

size_t Bins() { return BinOf(kGreatest) + 1; }

// The least error of a bin.
double LowOf(size_t bin) {
  if (bin == 0) return 0;
  return std::bit_cast<float>(static_cast<uint32_t>(bin - 1 + LeadingBits(kLeast)) << kDroppedBits);
}

}  // namespace

void ErrorTally::push_back(double error) {
  if (bins_.empty() && values_.size() == kExact) MoveToBins();
  if (bins_.empty()) {
    values_.push_back(error);
    ++count_;
  } else {
    Count(error);
  }
}

ErrorTally& ErrorTally::operator+=(const ErrorTally& other) {
  if (other.bins_.empty()) {
    for (const double error : other.values_) push_back(error);
    return *this;
  }
  if (bins_.empty()) MoveToBins();
  for (size_t bin = 0; bin < bins_.size(); ++bin) bins_[bin] += other.bins_[bin];
  count_ += other.count_;
  sum_ += other.sum_, max_ = std::max(max_, other.max_);
  return *this;
}

void ErrorTally::Count(double error) {
  ++bins_[BinOf(error)];
  ++count_;
  sum_ += error, max_ = std::max(max_, error);
}

void ErrorTally::MoveToBins() {
  bins_.assign(Bins(), 0);
  count_ = 0;
  for (const double error : values_) Count(error);
  std::vector<double>().swap(values_);  // assignment of {} would keep the memory
}

void ErrorTally::Seal() {
  sealed_ = Summary();
  std::vector<double>().swap(values_);
  std::vector<int64_t>().swap(bins_);
}

std::optional<ErrorSummary> ErrorTally::Summary() const {
  if (empty() || sealed_) return sealed_;
  if (bins_.empty()) return Summarize(values_);
  const auto percentile = [this](double share) {
    const double place = share * static_cast<double>(count_ - 1);
    double before = 0;
    for (size_t bin = 0; bin < bins_.size(); ++bin) {
      const auto inside = static_cast<double>(bins_[bin]);
      // Errors of a bin stand for its evenly spread parts.
      if (before + inside > place) {
        const double high = std::min(bin + 1 < bins_.size() ? LowOf(bin + 1) : max_, max_);
        return LowOf(bin) + (place - before + 0.5) / inside * (high - LowOf(bin));
      }
      before += inside;
    }
    return max_;
  };
  ErrorSummary out;
  out.count = count_;
  out.mean = sum_ / static_cast<double>(count_);
  out.median = std::min(percentile(0.5), max_);
  out.p95 = std::min(percentile(0.95), max_);
  out.p99 = std::min(percentile(0.99), max_);
  out.max = max_;
  return out;
}

}  // namespace weft
