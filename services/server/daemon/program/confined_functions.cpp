#include "services/server/daemon/program/confined_functions.h"

#include <stdexcept>
#include <string>

#include "services/ground/process/no_threads.h"
#include "services/work/pipeline/job_confinement.h"

namespace weft {
namespace {

// The answer of `work`, or an error why it did not run.
template <typename Answer>
Answer AnswerConfined(const Confinement& confinement, const std::function<Answer()>& work) {
  Answer answer = absl::InternalError("not run");
  try {
    const absl::Status confined = RunConfined(confinement, [&] { answer = work(); });
    if (!confined.ok()) answer = confined;
  } catch (const std::exception& error) {
    if (!IsLackOfThreads(error)) throw;
    answer = NoFurtherThreads();
  }
  return answer;
}

}  // namespace

void ConfineFunctions(DaemonOptions& options) {
  const LinkRules rules = {.allowed = options.allow_paths, .closed = options.state_folder};
  if (options.load_inputs) {
    options.load_inputs = [load = options.load_inputs,
                           rules](const v1::RegistrationSpec& spec) -> absl::StatusOr<LoadedInputs> {
      Confinement inputs = ConfinementOf(spec, rules);
      inputs.writable.clear();
      return AnswerConfined<absl::StatusOr<LoadedInputs>>(inputs, [&] { return load(spec); });
    };
  }
  if (options.find_incomplete) {
    options.find_incomplete = [find = options.find_incomplete, rules](
                                  const v1::Job& job, const std::vector<v1::FrameInfo>& frames) {
      return AnswerConfined<absl::StatusOr<std::vector<IncompleteFrame>>>(ConfinementOf(job.spec(), rules),
                                                                          [&] { return find(job, frames); });
    };
  }
  JobEndings& endings = options.endings;
  if (endings.assess) {
    endings.assess = [assess = endings.assess, rules](const std::string& out, const v1::Job& job) {
      v1::Verdict verdict;
      Confinement files = ConfinementOf(job.spec(), rules);
      files.writable = {out};
      const absl::Status confined = RunConfined(files, [&] { verdict = assess(out, job); });
      if (!confined.ok()) throw std::runtime_error(std::string(confined.message()));
      return verdict;
    };
  }
  if (endings.write_report) {
    endings.write_report = [write = endings.write_report, rules](const std::string& out, const v1::Job& job) {
      Confinement files = ConfinementOf(job.spec(), rules);
      files.writable = {out};
      return AnswerConfined<absl::Status>(files, [&] { return write(out, job); });
    };
  }
}

}  // namespace weft
