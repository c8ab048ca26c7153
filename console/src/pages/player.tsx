import { client } from "../app_state";
import { hrefOf, route } from "../router";
import { InThreeD } from "../ui/in_three_d";
import { Page } from "../ui/parts";

export function PlayerPage() {
  const jobId = route.value[1]!;
  return (
    <Page title={`Job ${jobId} in 3D`} actions={<a href={hrefOf("jobs", jobId)}>The job</a>}>
      <InThreeD key={jobId} mount={(player, element) => player.mountPlayer(element, client, jobId)} />
    </Page>
  );
}
