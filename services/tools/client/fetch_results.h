// All results of a job, from the daemon's machine to this one.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "services/tools/client/registration_client.h"
#include "weft/v1/job.pb.h"

namespace weft {

// Writes the finished frames' files to <out>/<frame>/ (report.json last) and job.json and report.html to
// <out>; folders are made. A frame or file that the job does not have is passed over. `progress` is called
// with the frames done and all of them. FailedPrecondition: a folder of a frame is a link. Cancelled: `stop`
// was requested; every file that stands there is whole. DataLoss: a file is not as the report of its frame
// lists it.
absl::Status FetchResults(RegistrationClient& client, const v1::Job& job, const std::string& out,
                          const std::function<void(size_t done, size_t total)>& progress,
                          std::stop_token stop = {});

}  // namespace weft
