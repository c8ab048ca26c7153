#include "services/ground/process/no_threads.h"

#include <algorithm>
#include <iterator>
#include <system_error>

#include "absl/strings/match.h"
#include "base/error_reason.h"

namespace weft {
namespace {

// strerror(EAGAIN); our programs set no language. Of reads it means something else, as ffmpeg says it.
constexpr absl::string_view kTextOfError = "Resource temporarily unavailable";
constexpr absl::string_view kTopics[] = {"hread", "fork", "system_error", "cannot be started"};

}  // namespace

absl::Status NoFurtherThreads() {
  return WithReason(
      absl::ResourceExhaustedError("this machine makes no further threads or processes now (Resource "
                                   "temporarily unavailable); where that lasts, raise TasksMax= of the "
                                   "service, or `ulimit -u`"),
      ErrorReason::kNoFreeThread);
}

bool IsLackOfThreads(const std::exception& error) {
  const auto* const of_system = dynamic_cast<const std::system_error*>(&error);
  return of_system != nullptr && of_system->code() == std::errc::resource_unavailable_try_again;
}

bool IsLackOfThreads(std::string_view message) {
  const absl::string_view text(message.data(), message.size());
  return absl::StrContains(text, kTextOfError) &&
         std::any_of(std::begin(kTopics), std::end(kTopics),
                     [&](absl::string_view topic) { return absl::StrContains(text, topic); });
}

}  // namespace weft
