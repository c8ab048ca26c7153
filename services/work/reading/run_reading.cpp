#include "services/work/reading/run_reading.h"

#include <exception>
#include <new>
#include <string>

#include "absl/strings/cord.h"
#include "base/status_macros.h"
#include "services/ground/confinement/confinement.h"
#include "services/results/report/job_report.h"
#include "services/results/report/job_verdict.h"
#include "services/work/items/check_item.h"
#include "services/work/kinds/work_kind.h"
#include "services/work/pipeline/job_confinement.h"

namespace weft {
namespace {

using What = v1::Reading::WhatCase;

const v1::JobToRead& JobOf(const v1::Reading& reading) {
  switch (reading.what_case()) {
    case What::kIncomplete:
      return reading.incomplete();
    case What::kAssess:
      return reading.assess();
    default:
      return reading.write_report();
  }
}

Confinement FilesOf(const v1::Reading& reading) {
  const LinkRules links = {.allowed = {reading.allowed_paths().begin(), reading.allowed_paths().end()},
                           .closed = reading.closed_folder()};
  Confinement files;
  if (reading.what_case() == What::kJobInputs) {
    files = ConfinementOf(reading.job_inputs(), links);
    files.writable.clear();
  } else if (reading.what_case() == What::kItem) {
    files.readable = {reading.item().folder()};
  } else {
    files = ConfinementOf(JobOf(reading).job().spec(), links);
    if (reading.what_case() != What::kIncomplete) files.writable = {JobOf(reading).out()};
  }
  return files;
}

absl::Status ReadInputs(const v1::RegistrationSpec& spec, v1::ReadingAnswer& answer) {
  WEFT_ASSIGN_OR_RETURN(const LoadedInputs inputs, ListInputs(spec));
  answer.mutable_frames()->Assign(inputs.frames.begin(), inputs.frames.end());
  *answer.mutable_hashes() = inputs.hashes;
  answer.mutable_warnings()->Assign(inputs.warnings.begin(), inputs.warnings.end());
  if (inputs.driven) *answer.mutable_driven() = *inputs.driven;
  return absl::OkStatus();
}

absl::Status FindIncomplete(const v1::JobToRead& asked, v1::ReadingAnswer& answer) {
  const std::vector<v1::FrameInfo> frames(asked.frames().begin(), asked.frames().end());
  WEFT_ASSIGN_OR_RETURN(const auto incomplete,
                        KindOf(asked.job().spec()).FindIncomplete(asked.job(), frames));
  for (const IncompleteFrame& frame : incomplete) {
    v1::ReadingAnswer::Incomplete& one = *answer.add_incomplete();
    one.set_position(static_cast<int64_t>(frame.position));
    one.set_why(frame.why);
    one.set_inputs_changed(frame.inputs_changed);
  }
  return absl::OkStatus();
}

absl::Status Do(const v1::Reading& reading, v1::ReadingAnswer& answer) {
  switch (reading.what_case()) {
    case What::kJobInputs:
      return ReadInputs(reading.job_inputs(), answer);
    case What::kIncomplete:
      return FindIncomplete(reading.incomplete(), answer);
    case What::kAssess:
      *answer.mutable_verdict() = AssessJobFolder(reading.assess().out(), reading.assess().job());
      return absl::OkStatus();
    case What::kWriteReport:
      return WriteJobReport(reading.write_report().out(), reading.write_report().job());
    case What::kItem:
      return CheckItemContent(reading.item().kind(), reading.item().manifest(), reading.item().folder());
    default:
      return absl::InvalidArgumentError("what: nothing is to be read");
  }
}

}  // namespace

absl::Status StatusOf(const v1::ReadingAnswer& answer) {
  absl::Status status(static_cast<absl::StatusCode>(answer.code()), answer.message());
  for (const auto& [type, bytes] : answer.details()) status.SetPayload(type, absl::Cord(bytes));
  return status;
}

void SetStatus(const absl::Status& status, v1::ReadingAnswer& answer) {
  answer.set_code(static_cast<int>(status.code()));
  answer.set_message(std::string(status.message()));
  status.ForEachPayload([&answer](absl::string_view type, const absl::Cord& bytes) {
    (*answer.mutable_details())[std::string(type)] = std::string(bytes);
  });
}

v1::ReadingAnswer RunReading(const v1::Reading& reading) {
  v1::ReadingAnswer answer;
  absl::Status status;
  try {
    status = ConfineProcess(FilesOf(reading));
    if (status.ok()) status = Do(reading, answer);
  } catch (const std::bad_alloc&) {
    status = absl::ResourceExhaustedError("reading the files takes too much memory");
  } catch (const std::exception& error) {
    status = absl::InternalError(error.what());
  }
  if (!status.ok()) answer.Clear();
  SetStatus(status, answer);
  return answer;
}

}  // namespace weft
