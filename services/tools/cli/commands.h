// The commands of `weft`; each adds itself to the program. One file each: command_<name>.cpp.
#pragma once

#include <CLI/CLI.hpp>

#include "services/tools/cli/command_line.h"

namespace weft {

void AddAccessCommand(CLI::App& app, CommandLine& line);
// One for each kind of jobs that has no fields, and so no command, of its own (kind_info.h).
void AddKindCommands(CLI::App& app, CommandLine& line);
void AddJobCommand(CLI::App& app, CommandLine& line);
void AddJobPlanCommand(CLI::App& job, CommandLine& line);
void AddLibraryCommand(CLI::App& app, CommandLine& line);
void AddRegisterCommand(CLI::App& app, CommandLine& line);
void AddRigCommand(CLI::App& app, CommandLine& line);
void AddRigCalibrateCommands(CLI::App& rig, CommandLine& line);
void AddRigExchangeCommand(CLI::App& rig, CommandLine& line);
void AddRigPlanCommand(CLI::App& rig, CommandLine& line);
void AddRigRefineCommand(CLI::App& rig, CommandLine& line);
void AddPatternCommand(CLI::App& app, CommandLine& line);
void AddPatternPrintCommand(CLI::App& pattern, CommandLine& line);
void AddPatternPaletteCommand(CLI::App& pattern, CommandLine& line);
void AddAvatarCommand(CLI::App& app, CommandLine& line);
void AddAvatarTrainCommand(CLI::App& avatar, CommandLine& line);
void AddAvatarDriveCommand(CLI::App& avatar, CommandLine& line);
void AddBodyCommand(CLI::App& app, CommandLine& line);
void AddCameraCommand(CLI::App& app, CommandLine& line);
void AddCameraLookCommand(CLI::App& camera, CommandLine& line);
void AddCameraFakeCommand(CLI::App& camera, CommandLine& line);
void AddDaemonCommand(CLI::App& app, CommandLine& line);
void AddDatasetCommand(CLI::App& app, CommandLine& line);
void AddDatasetMeshesCommand(CLI::App& dataset, CommandLine& line);
void AddDoctorCommand(CLI::App& app, CommandLine& line);
void AddEvaluateCommand(CLI::App& app, CommandLine& line);
void AddExportCommand(CLI::App& app, CommandLine& line);
void AddGarmentCommand(CLI::App& app, CommandLine& line);
void AddSessionCommand(CLI::App& app, CommandLine& line);
void AddSimulateCommand(CLI::App& app, CommandLine& line);
void AddSplitCommand(CLI::App& app, CommandLine& line);
void AddSupportCommand(CLI::App& app, CommandLine& line);
void AddTakeCommand(CLI::App& app, CommandLine& line);
void AddTakeCopyCommands(CLI::App& take, CommandLine& line);
void AddTakeDescribeCommands(CLI::App& take, CommandLine& line);
void AddTakeImportCommand(CLI::App& take, CommandLine& line);
void AddTakeRecordCommand(CLI::App& take, CommandLine& line);
void AddRemoteTakeCommands(CLI::App& take, CommandLine& line);
void AddTakeReplayCommand(CLI::App& take, CommandLine& line);
void AddTakeSyncCommand(CLI::App& take, CommandLine& line);
void AddTemplateCommand(CLI::App& app, CommandLine& line);
void AddTemplateBuildCommand(CLI::App& garment, CommandLine& line);
void AddTemplateCheckCommand(CLI::App& garment, CommandLine& line);
void AddTemplateJoinCommand(CLI::App& garment, CommandLine& line);
void AddMotionCommand(CLI::App& app, CommandLine& line);
void AddOperationCommand(CLI::App& app, CommandLine& line);
void AddOptionsCommand(CLI::App& app, CommandLine& line);
void AddDecodeCommand(CLI::App& app, CommandLine& line);
void AddAlignCommand(CLI::App& app, CommandLine& line);

}  // namespace weft
