// weft access: whom a daemon knows.
#include <cstdio>
#include <map>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "services/server/access/access_list.h"
#include "services/server/access/audit_log.h"
#include "services/server/access/role_words.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"

namespace weft {
namespace {

struct AccessCommandOptions {
  std::string state_folder;
  std::string who;  // a name, or an id
  std::string role;
  double days = 0;
  bool json = false;
  int last = 50;  // entries
};

absl::Status AddAccessToken(const AccessCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const v1::Role role, ParseRole(options.role));
  WEFT_ASSIGN_OR_RETURN(const NewToken added,
                        AddToken(AccessListFile(options.state_folder), {options.who, role, options.days}));
  std::fprintf(stderr, "token %s of %s, %s; it is shown this once:\n", added.token.id().c_str(),
               options.who.c_str(), options.role.c_str());
  std::printf("%s\n", added.text.c_str());
  return absl::OkStatus();
}

absl::Status AllowAccessCertificate(const AccessCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const v1::Role role, ParseRole(options.role));
  return AllowCertificate(AccessListFile(options.state_folder), options.who, role);
}

absl::Status RevokeAccessOf(const AccessCommandOptions& options) {
  return RevokeAccess(AccessListFile(options.state_folder), options.who);
}

std::string DayOf(int64_t unix_ns) {
  if (unix_ns == 0) return "never";
  return absl::FormatTime("%Y-%m-%d", absl::FromUnixNanos(unix_ns), absl::LocalTimeZone());
}

absl::Status ListAccess(const AccessCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const v1::AccessList list, ReadAccessList(AccessListFile(options.state_folder)));
  if (options.json) return PrintJsonMessage(list);
  if (list.tokens().empty() && list.certificates().empty())
    std::printf("no tokens and no certificates: the daemon knows its own user and root alone\n");
  for (const v1::Token& token : list.tokens()) {
    std::printf("token        %-20s  %-8s  id %s, made %s, expires %s\n", token.name().c_str(),
                RoleWord(token.role()), token.id().c_str(), DayOf(token.created_unix_ns()).c_str(),
                DayOf(token.expires_unix_ns()).c_str());
  }
  for (const v1::CertificateOwner& owner : list.certificates())
    std::printf("certificate  %-20s  %-8s\n", owner.common_name().c_str(), RoleWord(owner.role()));
  return absl::OkStatus();
}

absl::Status PrintAuditLog(const AccessCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const auto entries,
                        ReadAuditLog(AuditLogFile(options.state_folder), static_cast<size_t>(options.last)));
  for (const v1::AuditEntry& entry : entries) {
    std::string about;
    for (const auto& [field, value] :
         std::map<std::string, std::string>(entry.about().begin(), entry.about().end()))
      absl::StrAppend(&about, "  ", field, "=", value);
    const std::string from = entry.peer() == entry.caller() ? "" : absl::StrCat(" from ", entry.peer());
    const std::string times = entry.times() > 1 ? absl::StrCat(" (", entry.times(), " times)") : "";
    const std::string reason = entry.message().empty() ? "" : absl::StrCat(": ", entry.message());
    std::printf("%s  %-20s %s%s  %s%s%s%s\n", entry.time().c_str(), entry.outcome().c_str(),
                entry.caller().empty() ? "nobody known" : entry.caller().c_str(), from.c_str(),
                entry.method().empty() ? "connections" : entry.method().c_str(), times.c_str(), about.c_str(),
                reason.c_str());
  }
  return absl::OkStatus();
}

// With the state folder of the daemon.
CommandWithOptions<AccessCommandOptions> AddAccess(CLI::App& group, CommandLine& line, const char* name,
                                                   const char* description, const char* example,
                                                   absl::Status (*run)(const AccessCommandOptions&)) {
  auto made = AddCommand<AccessCommandOptions>(group, line, run, name, description, example);
  AddRequired(*made.command, "--state DIR", made.options->state_folder,
              "State folder of the daemon, on this machine")
      ->envname("WEFT_STATE")
      ->check(CLI::ExistingDirectory);
  return made;
}

void AddRoleAndName(CLI::App& command, AccessCommandOptions& options, const char* whose) {
  AddRequired(command, "--role ROLE", options.role,
              "viewer looks; client also sends work; operator also runs cameras, sessions and takes; admin "
              "may do everything")
      ->check(OneOf({"viewer", "client", "operator", "admin"}));
  AddRequired(command, "NAME", options.who, whose);
}

}  // namespace

void AddAccessCommand(CLI::App& app, CommandLine& line) {
  CLI::App* group = AddGroup(app, "access",
                             "Whom a daemon knows, besides its own user and root: tokens and certificates "
                             "with roles. A daemon that runs takes changes within a second.");
  const auto token = AddAccess(
      *group, line, "token",
      "Make a token, and print it. Its owner keeps it in a file of mode 0600 that WEFT_TOKEN_FILE names.",
      "  weft access token anna --role operator --days 90 --state /var/lib/weft > anna.token",
      AddAccessToken);
  AddRoleAndName(*token.command, *token.options, "Whose it is");
  AddOption(*token.command, "--days DAYS", token.options->days, "It expires after so long; 0: never",
            CLI::NonNegativeNumber);
  const auto certificate = AddAccess(
      *group, line, "certificate", "Give the owner of a certificate a role, or another role.",
      "  weft access certificate render-1 --role client --state /var/lib/weft", AllowAccessCertificate);
  AddRoleAndName(*certificate.command, *certificate.options, "The certificate's common name");
  const auto revoke =
      AddAccess(*group, line, "revoke", "Take a token back, or the role of a certificate's owner.",
                "  weft access revoke 0a1b2c3d4e5f --state /var/lib/weft", RevokeAccessOf);
  AddRequired(*revoke.command, "ID", revoke.options->who,
              "Id of the token, or the certificate's common name");
  const auto list = AddAccess(*group, line, "list", "List tokens and certificates.",
                              "  weft access list --state /var/lib/weft", ListAccess);
  list.command->add_flag("--json", list.options->json, "Print JSON");
  const auto log =
      AddAccess(*group, line, "log",
                "Show who changed what through the daemon, and who was refused, from its audit log.",
                "  weft access log --state /var/lib/weft --last 20", PrintAuditLog);
  AddOption(*log.command, "--last N", log.options->last, "So many entries, the newest at the end",
            CLI::Range(1, 1'000'000));
}

}  // namespace weft
