// SPDX-License-Identifier: GPL-3.0-or-later
//
// Flamenco job type: frames of a .blend by "blender --command hybrid render". Put it into the folder "scripts" beside
// flamenco-manager; the workers' Blender needs the extension installed.

const JOB_TYPE = {
    label: "Hybrid Render",
    description: "EEVEE, with the flagged objects ray traced",
    settings: [
        {
            key: "frames", type: "string", required: true,
            eval: "f'{C.scene.frame_start}-{C.scene.frame_end}'",
            evalInfo: { showLinkButton: true, description: "Scene frame range" },
            description: "Frames to render: '47', '1-30', '3, 5-10, 47-327'",
        },
        {
            key: "chunk_size", type: "int32", default: 10, propargs: { min: 1 }, visible: "submission",
            description: "Frames that one start of Blender renders",
        },
        {
            key: "image_file_extension", type: "string", choices: [".png", ".exr"], default: ".png",
            description: "PNG, or EXR (scene-linear, 32 bit)",
        },
        {
            key: "render_output_root", type: "string", subtype: "dir_path", required: true, visible: "submission",
            description: "Folder for the pictures; a folder for this job is made in it",
        },
        {
            key: "render_output_path", type: "string", subtype: "file_path", editable: false,
            eval: "str(Path(abspath(settings.render_output_root), jobname, '{timestamp}', '######'))",
            description: "Where the pictures will be",
        },
        { key: "blendfile", type: "string", required: true, visible: "web", description: "The scene" },
        { key: "scene", type: "string", required: true, visible: "web", eval: "C.scene.name", description: "Its scene" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    settings.render_output_path = settings.render_output_path.replace("{timestamp}", formatTimestampLocal(job.created));
    for (const chunk of frameChunker(settings.frames, settings.chunk_size)) {
        const task = author.Task(`render-${chunk}`, "blender");
        task.addCommand(author.Command("blender-render", {
            exe: "{blender}",
            exeArgs: "{blenderArgs}",
            argsBefore: ["--command", "hybrid", "render"],
            blendfile: settings.blendfile,
            args: [
                "--output", settings.render_output_path + settings.image_file_extension,
                "--make-folder",
                "--file-outputs", // the job's own
                "--scene", settings.scene,
                `--frames=${chunk}`,
                "--skip-existing", // a task that is tried again goes on where it was
            ],
        }));
        job.addTask(task);
    }
}
