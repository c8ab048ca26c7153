// weft daemon: what an administrator does with a daemon that runs.
#include <cstdio>
#include <functional>
#include <memory>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "services/server/retention/retention_plan.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/client/server_client.h"

namespace weft {
namespace {

struct DrainCommandOptions {
  std::string server;
  bool finish_jobs = false;
};

absl::Status RunDrain(const DrainCommandOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(options.server));
  v1::DrainRequest request;
  request.set_finish_jobs(options.finish_jobs);
  std::string told;
  WEFT_RETURN_IF_ERROR(ServerClient(*connection).DrainUntilItStops(request, [&](const auto& progress) {
    std::string line = absl::StrCat(progress.frames_running(), " frames run, ", progress.jobs_unfinished(),
                                    " jobs have not ended");
    if (quiet || line == told) return;
    std::fprintf(stderr, "draining: %s\n", line.c_str());
    told = std::move(line);
  }));
  std::printf("the daemon at %s has stopped; its next start goes on\n", options.server.c_str());
  return absl::OkStatus();
}

struct RetentionCommandOptions {
  std::string server;
  bool dry_run = false;
  bool json = false;
  v1::RehearseRetentionRequest request;  // a rule that it lacks is as in force
};

std::string UnlessZero(double value, const std::string& words, const std::string& otherwise) {
  return value > 0 ? absl::StrFormat("%g %s", value, words) : otherwise;
}

void PrintRules(const v1::RetentionRules& rules) {
  std::printf(
      "takes: %s; %s; %s\n",
      UnlessZero(rules.keep_takes_days(), "days, then the trash", "kept at any age").c_str(),
      UnlessZero(rules.takes_quota_gib(), "GiB with the trash at most", "no quota").c_str(),
      UnlessZero(rules.least_free_gib(), "GiB of the disk stay free", "no room is kept free").c_str());
  std::printf("trash: %g days, and %g hours where room is needed\n", rules.keep_trash_days(),
              rules.least_trash_hours());
  std::printf("jobs: %s; operations: %g days; uploads: %g days; notices: %g days\n",
              UnlessZero(rules.keep_jobs_days(), "days after their end", "kept").c_str(),
              rules.keep_trash_days(), rules.keep_uploads_days(), rules.keep_notices_days());
}

std::string WhenDue(double due_in_s) {
  if (due_in_s <= 0) return "now";
  constexpr double kHour_s = 3600, kDay_s = 24 * kHour_s;
  return due_in_s < 2 * kDay_s ? absl::StrFormat("in %.1f hours", due_in_s / kHour_s)
                               : absl::StrFormat("in %.1f days", due_in_s / kDay_s);
}

void PrintStep(const v1::RetentionStep& step, const std::string& when) {
  const std::string size =
      step.bytes() > 0 ? absl::StrFormat(" (%.2f GiB)", static_cast<double>(step.bytes()) / 1073741824.0)
                       : "";
  std::printf("  %-12s %s %s%s %s: %s\n", when.c_str(), HoldingWords(step.kind()), step.id().c_str(),
              size.c_str(), step.to_trash() ? "goes to the trash" : "is removed for good",
              step.because().c_str());
}

absl::Status RunRetention(const RetentionCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(options.server));
  WEFT_ASSIGN_OR_RETURN(const auto rehearsal, ServerClient(*connection).RehearseRetention(options.request));
  if (options.json) return PrintJsonMessage(rehearsal);
  PrintRules(rehearsal.rules());
  std::printf("days count while the daemon runs: it has seen %.2f\n", rehearsal.seen_days());
  if (options.dry_run) {
    std::printf(rehearsal.steps().empty() ? "nothing would go\n" : "would go, in this order:\n");
    for (const v1::RetentionStep& step : rehearsal.steps()) PrintStep(step, WhenDue(step.due_in_s()));
    for (const std::string& note : rehearsal.notes()) std::printf("note: %s\n", note.c_str());
    return absl::OkStatus();
  }
  std::printf(rehearsal.done().empty() ? "nothing went since its start; audit.log has what went before\n"
                                       : "went since its start, newest first; audit.log has the times:\n");
  for (const v1::RetentionStep& step : rehearsal.done()) PrintStep(step, "gone");
  return absl::OkStatus();
}

void AddRetention(CLI::App& group, CommandLine& line) {
  const auto options = std::make_shared<RetentionCommandOptions>();
  CLI::App* retention = AddCommand(
      group, "retention",
      "Show what a daemon removes by itself: its rules, and what went lately. --dry-run shows what would go, "
      "also by other rules, and removes nothing. Ages count in days that the daemon has run, so that neither "
      "a wrong clock nor a start makes anything old. Each removal is a line of audit.log beforehand.",
      "  weft daemon retention --server unix:/var/lib/weft/weftd.sock\n"
      "  weft daemon retention --dry-run --ahead-days 7 --server 127.0.0.1:7411\n"
      "  weft daemon retention --dry-run --keep-takes-days 30 --server 127.0.0.1:7411");
  AddServerOption(*retention, options->server, "unix:PATH or HOST:PORT of the daemon")->required();
  CLI::Option* dry_run = retention->add_flag("--dry-run", options->dry_run, "Show what would go");
  retention->add_flag("--json", options->json, "Print all of it as JSON (weft.v1.RetentionRehearsal)");
  const auto add = [&](const std::string& name, const std::string& what,
                       const std::function<void(double)>& set) {
    retention->add_option_function<double>(name, set, what)
        ->type_name(absl::AsciiStrToUpper(name.substr(name.rfind('-') + 1)))
        ->check(CLI::Range(0.0, name.ends_with("-gib") ? 1e9 : 36500.0))
        ->needs(dry_run);
  };
  add("--ahead-days", "Also what will go within so many days",
      [options](double days) { options->request.set_ahead_days(days); });
  v1::RetentionRules& rules = *options->request.mutable_rules();
  for (int i = 0; i < rules.GetDescriptor()->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* rule = rules.GetDescriptor()->field(i);
    add(absl::StrCat("--", absl::StrReplaceAll(rule->name(), {{"_", "-"}})),
        i == 0 ? "As if the daemon had this rule" : "The same", [options, rule](double value) {
          v1::RetentionRules& asked = *options->request.mutable_rules();
          asked.GetReflection()->SetDouble(&asked, rule, value);
        });
  }
  RunWith(*retention, line, options, RunRetention);
}

}  // namespace

void AddDaemonCommand(CLI::App& app, CommandLine& line) {
  CLI::App* group = AddGroup(app, "daemon", "Administer a daemon that runs.");
  const auto [drain, options] = AddCommand<DrainCommandOptions>(
      *group, line, RunDrain, "drain",
      "Stop a daemon without loss of work, for example for an update. It refuses "
      "new jobs, takes and operations, lets the frames end that workers are at, and "
      "stops. Takes that are recorded go on without it.",
      "  weft daemon drain --server unix:/var/lib/weft/weftd.sock\n"
      "  weft daemon drain --jobs --server 127.0.0.1:7411");
  AddServerOption(*drain, options->server, "unix:PATH or HOST:PORT of the daemon")->required();
  drain->add_flag("--jobs", options->finish_jobs, "Let all jobs end first");
  AddRetention(*group, line);
}

}  // namespace weft
