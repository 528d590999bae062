// SPDX-License-Identifier: GPL-3.0-or-later
//
// Job type of Flamenco 3 (Blender's own farm) for the extension Underwater Spectral.
// Put this file into the folder `scripts` beside the Flamenco Manager and restart it.
// The workers need the extension, enabled: every task is `blender --command underwater …`.

const JOB_TYPE = {
    label: "Underwater Spectral",
    description: "Spectral bands of an underwater scene: planned, rendered pass by pass, developed",
    settings: [
        // For artists.
        { key: "frames", type: "string", required: true,
          eval: "f'{C.scene.frame_start}-{C.scene.frame_end}'",
          evalInfo: { showLinkButton: true, description: "Scene frame range" },
          description: "Frames to render, such as '47', '1-30' or '3, 5-10'" },
        { key: "passes", type: "int32", required: true, propargs: { min: 1, max: 512 },
          eval: "C.scene.underwater_panel.pass_count",
          evalInfo: { showLinkButton: true, description: "Passes of the panel's settings" },
          description: "Render passes of a frame" },
        { key: "passes_per_task", type: "int32", default: 1, propargs: { min: 1, max: 512 },
          visible: "submission",
          description: "Passes that one task renders; more where Blender takes long to start" },
        { key: "options", type: "string", required: true,
          eval: "C.scene.underwater_panel.job_options",
          evalInfo: { showLinkButton: true, description: "Engine and mode of the panel" },
          description: "Options of the plan as on the command line; the file's settings need none" },

        // render_output_root and add_path_components determine render_output_path.
        { key: "render_output_root", type: "string", subtype: "dir_path", required: true,
          visible: "submission",
          description: "Folder of all renders; the job gets a folder of its own in it" },
        { key: "add_path_components", type: "int32", required: true, default: 0,
          propargs: { min: 0, max: 32 }, visible: "submission",
          description: "Number of path components of the blend file to use in the output path" },
        { key: "render_output_path", type: "string", subtype: "file_path", editable: false,
          eval: "str(Path(abspath(settings.render_output_root), last_n_dir_parts(settings.add_path_components), jobname, '{timestamp}'))",
          description: "Folder of the plan, the passes and the pictures" },

        // Set by the add-on.
        { key: "blendfile", type: "string", required: true, visible: "web",
          description: "The scene" },
    ],
};

// More than a job has: all of them in one chunk, written as ranges.
const ALL_FRAMES = 10000000;

function compileJob(job) {
    const settings = job.settings;
    const passes = integer(settings, "passes", 1);
    const perTask = integer(settings, "passes_per_task", 1);
    if (!settings.render_output_path) {
        throw "render_output_path is empty; choose a render output root";
    }
    // What was used is shown when the job is looked at later.
    const out = settings.render_output_path.replace("{timestamp}", formatTimestampLocal(job.created));
    settings.render_output_path = out;
    const manifest = path.join(out, "manifest.json");

    const options = shellSplit(settings.options || "");
    const trust = options.filter(option => option === "--trust-scripts");

    const plan = author.Task("plan", "blender");
    plan.addCommand(author.Command("make-directory", { path: out }));
    plan.addCommand(blenderCommand(settings.blendfile, options.concat([
        "--frames", frameChunker(settings.frames, ALL_FRAMES)[0],
        "--out", out,
        "--plan", manifest,
    ])));
    job.addTask(plan);

    // A frame's development follows its passes in the list: it is picked up as soon as they
    // are there, while later frames render.
    for (const frame of frameChunker(settings.frames, 1)) {
        const develop = blenderTask(`develop-${frame}`, settings.blendfile, [
            "--from", manifest, "--frames", frame, "--develop", ...trust,
        ]);
        for (let first = 0; first < passes; first += perTask) {
            const chunk = span(first, Math.min(first + perTask, passes) - 1);
            const render = blenderTask(`render-${frame}-pass-${chunk}`, settings.blendfile, [
                "--from", manifest, "--frames", frame, "--passes", chunk, ...trust,
            ]);
            render.addDependency(plan);
            develop.addDependency(render);
            job.addTask(render);
        }
        job.addTask(develop);
    }
}

// A task that runs the extension's command on a scene.
function blenderTask(name, blendfile, options) {
    const task = author.Task(name, "blender");
    task.addCommand(blenderCommand(blendfile, options));
    return task;
}

function blenderCommand(blendfile, options) {
    return author.Command("exec", {
        exe: "{blender}",
        args: ["--command", "underwater", blendfile].concat(options),
    });
}

// "3" or "3-5".
function span(first, last) {
    return first === last ? `${first}` : `${first}-${last}`;
}

// The whole number of a setting.
function integer(settings, key, least) {
    const value = Number(settings[key] === undefined ? least : settings[key]);
    if (!Number.isInteger(value) || value < least) {
        throw `${key} is ${settings[key]}; it must be a whole number of at least ${least}`;
    }
    return value;
}
