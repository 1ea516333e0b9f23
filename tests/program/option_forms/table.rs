//! Table of the forms of options.

/// Names of commands in the table, their words, and the arguments that each form is added to,
/// unless it names the same option.
pub const BASES: &[(&str, &str, &str)] = &[
    ("trisect", "", ""),
    ("render", "render", "a.ron --backend=cpu --output=a.png"),
    ("resume", "resume", "done.ckpt"),
    ("merge", "merge", "done.ckpt --output=b.png"),
    ("bench", "bench", "a.ron --backend=cpu --frames=1"),
    (
        "report",
        "bench report",
        "--backend=cpu --quick --resolution=8x4 --spheres=10 --time-limit=1 --output=b",
    ),
    (
        "cluster",
        "bench cluster",
        "a.ron --backend=cpu --frames=2 --frame-spp=1 --average-spp=1 --noise-spp=1 --output=b",
    ),
    (
        "tradeoff",
        "tradeoff",
        "a.ron --backend=cpu --levels=1 --seeds=4 --knobs=depth --reference-spp=1 --cache=b --output=c",
    ),
    (
        "converge",
        "converge",
        "a.ron --backend=cpu --first=1 --last=4 --seeds=4 --knobs=depth --reference-spp=1 --cache=b",
    ),
    ("view", "view", "a.ron --backend=cpu --headless --frames=1"),
    ("evaluate", "evaluate", "seeds --reference=others"),
    ("compare", "compare", "a.png a.png"),
    ("check", "check", "a.ron"),
    ("info", "info", ""),
    ("doctor", "doctor", ""),
    ("completions", "completions", "bash"),
    ("man", "man", ""),
];

/// Names of groups of commands in the table. `every` stands for all commands.
pub const GROUPS: &[(&str, &str)] = &[
    ("job", "render bench cluster tradeoff converge view"),
    ("load", "render bench cluster tradeoff converge view check"),
    ("file", "render resume merge"),
    ("ranks", "render resume view"),
];

/// Forms of options: name | commands | accepted | refused. A line without a name continues the
/// option above.
///
/// - A line in brackets names options that the lines below it need, and a scene in place of a.ron.
/// - `.` is the option without a value, `""` the empty value, and `␣` a space. `never` is not run.
/// - `@` precedes the exit codes that are possible, if they are not 0 of an accepted and 2 of a
///   refused form.
/// - `~` precedes a word of the message, if that does not name the option.
/// - `{n}` is a number that no other run has.
/// - `*` marks options that only a build with MPI lists.
///
/// The first command of each line also refuses the option with a missing, an empty or a surplus
/// value, without a form here.
pub const TABLE: &str = r#"
--help             | every                 | .                             |
--version          | trisect               | .                             |

# Scenes.
--allow-outside    | load report resume    | .                             |
--env              | load                  | studio uniform                | nosuch~studio Sky~studio ""
                   | render                | sky sky.pfm                   | nosuch.pfm@4~nosuch.pfm
                   | check                 | sky.pfm                       | nosuch.pfm@4~nosuch.pfm
--sun              | load                  | 135,40 -90,0,3 10.5,␣90       | 10 10,91 400,3 nan,3 10,20,-1
                   | load                  |                               | 10,20,inf x,y 1,2,3,4
--ground           | load                  | off                           | on@4 nosuch OFF
--set              | load                  | camera.vertical_fov=20        | camera.vertical_fov =20 image=
                   | load                  |                               | camera.nosuch=1@4
                   | load                  |                               | image.width=nan@4

[model.ron]
--time             | load                  | 0 -1.5s                       | 1x nan inf 1e400 1h30m 5%
                   | render check          | -1 250ms .5 0.01m 1min        |
                   | render check          | 1h 0.5␣s                      |
--animation        | load                  | slide                         | nosuch@4~animation ""@4~animation
--material-variant | load                  | day                           | nosuch@4~variant ""@4~variant
--frames           | render                | 0..1 1..3                     | 3 1..1 2..1 -1..2 0..=2 0..x
--shutter          | render                | 0 0.5 1                       | 1.01 -0.1 nan inf 180deg

[--camera-path=path.ron]
--frames           | render                | 0..1                          | 1..1

[]
--camera-path      | render                | path.ron                      | nosuch.ron@4~nosuch.ron

[model.ron --frames=0..1]
--fps              | render                | 24 0.5 30000/1001             | 0 -24 nan inf 24/0 24fps 1e7

[model.ron --shutter=0.5]
--shutter-steps    | render                | 1                             | 0 -1 1.5 x

[square.gltf --resolution=8x8 --spp=1]
--ground           | render                | on off                        | 1

[]
--camera           | job check             | 0 camera                      | 1@4~unknown nosuch@4~unknown
                   | job check             |                               | ""@4~unknown
--look-from        | job check             | -1,0,5 0,.5,5e0               | 1,2 1,2,3,4 a,b,c 1,2,inf nan,0,5
                   | job check             |                               | 0,0,0@4~look_from
--look-at          | job check             | -.5,0,0 0,␣0,1                | 1,2 a,b,c 1,2,inf 0,0,5@4~look_at
--up               | job check             | -1,1,0 0,1,0                  | 1,2 a,b,c inf,0,0 0,0,0@4~up
--fov              | job check             | 1 39.5 179                    | 0 180 -1 nan inf 40deg
--defocus-angle    | job check             | 0 0.5                         | 180 -1 nan inf 1deg
--focus-distance   | job check             | 1 2.5                         | 0 -1 nan inf 1m
                   | job check             |                               | 1e99@4~focus_distance

# Devices. Where there is no GPU, its forms end with code 3.
--backend          | job report            | cpu auto wgpu@0/3 cuda@0/3    | nosuch CPU gpu
                   | resume                | cpu auto@0/2                  | nosuch CPU
                   | resume                | wgpu@0/2/3 cuda@0/2/3         |
--threads          | job report resume     | 1 2                           | 0 1025 -1 1.5 x

[--backend=cpu]
--device           | job report resume     | 0                             | 1@3 -1 1.5 x

# Settings.
[]
--width            | job                   | 1 16                          | 0 -1 1.5 16px nan
--height           | job                   | 1 9                           | 0 -1 1.5 9px inf
--resolution       | job report            | 16x9 8X4                      | 16 0x9 16x0 -1x9 16x9x2 16*9 x
--spp              | job                   | 1 2                           | 0 -1 1.5 1spp nan
                   | view                  | 256                           | 257
--depth            | job                   | 1 5                           | 0 -1 1.5 x 65536
--seed             | job                   | 0 4294967295                  | -1 1.5 x 4294967296
--roulette         | job                   | on off                        | nosuch ON true
--roulette-depth   | job                   | 1 3                           | 0 -1 1.5 x
--sampler          | job                   | independent sobol             | nosuch Sobol
--light-sampling   | job                   | on off                        | nosuch ON
--clamp            | job                   | 0.5 10                        | x
                   | render bench view     |                               | 0 -1 nan inf
                   | tradeoff converge     |                               | 0 -1 nan inf
--bvh-quality      | job                   | fast medium high              | nosuch 1
--instances        | job                   | auto share copy               | nosuch on
--traversal        | job                   | linear stack wide             | nosuch bvh
--schedule         | job                   | pixel regenerate              | nosuch Pixel
                   | job                   | persistent interleaved        |
--tile             | job                   | 0 4 1024                      | 3 2048 -1 1.5 x
--sums             | job                   | auto host device              | nosuch gpu
--features         | job                   | all +nee +                    | nosuch +all ALL
                   | render bench view     |                               | ""
                   | converge              |                               | ""
--math             | job report            | precise                       | nosuch
                   | render bench report   |                               | fast
                   | tradeoff view cluster |                               | fast
                   | converge              |                               | fast
--deny-warnings    | load                  | .                             |

# Frames and denoisers.
--frames           | bench view            | 1 3                           | 0 -1 1.5 x 0..2
                   | cluster               | 2                             | 0 1 100001 -1 x
--denoise          | render bench view     | off atrous svgf               | nosuch SVGF
                   | render bench          | oidn@0/3                      |
                   | view                  |                               | oidn

[--denoise=svgf]
--denoise-levels   | render bench view     | 1 10                          | 0 11 -1 1.5 x
--denoise-color    | render bench view     | 0 4.5 inf                     | -1 nan x
--denoise-normal   | render bench view     | 0 4.5 inf                     | -1 nan 5deg
--denoise-depth    | render bench view     | 0 4.5 inf                     | -1 nan 5%

# Goals. The forms of --quality whose goals take seconds have a limit.
[]
--budget           | render                | 20ms .02 0.02s 0.0003m        | 0 0.9ms 1000001 -1 1x nan inf 5%

[--time-limit=20ms]
--quality          | render                | draft@7 preview@7             | nosuch Draft

[--max-spp=1]
--quality          | render                | final                         | 1
--target-error     | render                | 5% 5 0.05 0.5␣%               | 0 100% -1% nan inf 1s x

[--target-error=5]
--adaptive         | render                | off on auto                   | nosuch ON
--max-spp          | render                | 1 2                           | 0 -1 1.5 x

# Checkpoints.
[]
--checkpoint       | render                | {n}.ckpt                      | done.ckpt~exists a.ron~exists
--every            | resume                | 500ms 1min 1spp 30            | 0s 0spp -1s inf x
--time-limit       | render resume         | 99 99s 99000ms 1m 1h          | 0 -1 1x nan inf 5% 1spp 1h30m
                   | report                | 1 1s 900ms 0.02m              | 0 -1 1x nan inf
                   | tradeoff converge     | 99 99000ms 1m                 | 0 -1 1x nan inf
--fallback         | render resume         | cpu                           | nosuch wgpu
--scene            | resume                | a.ron                         | nosuch.ron@4~nosuch.ron

[--checkpoint={n}.ckpt]
--every            | render                | 1s .5m 2h 1024spp 1␣spp 30    | 0s 0spp -1s nan 1.5spp 5x

[parts.ron --checkpoint={n}.ckpt]
--sample-range     | render                | 0..256 256..300               | 256 2..1 0..0 -1..256 0..=255
                   | render                |                               | 1..2~chunk 0..512~samples

# Files.
[--output=b.exr]
--aov              | render                | normal normal,depth id        | nosuch Normal normal, id,id
                   | render                | position,albedo,variance      |
                   | render                | samples cryptomatte           | motion
                   | render                | shading-normal uv             |
                   | render                | geometric-normal,uv           |
--light-group      | render                | sky_light=sky all=* a-1=s*,s* | sky =sky a= a.b=sky rest=sky
                   | render                |                               | a=nosuch@4~nosuch
--float            | file                  | .                             |

[]
--crop             | render                | 0,0,1,1 .5,0,1,.5 0,1,8,9     | 1,2,3 0,0,0,1 1,0,.5,1 -1,0,1,1
                   | render                |                               | 0,0,99,9 nan,0,1,1 0,0,8.5,9
--background       | render                | sky transparent 0.2,.3,4      | red 1,2 #12345 -1,0,0 nan,0,0
                   | render                | #ff8000 0,␣0,0                | inf,0,0 Sky
--output           | render resume         | b.png b.jpg b.tif b.exr b.PNG | b~format b.txt~format
                   | render                | b.hdr b.pfm - exr:-           |
                   | merge                 | b.png b.exr {n}.ckpt          | done.ckpt~-o
                   | report tradeoff       | b                             | a.ron@1~a.ron
                   | cluster               | b                             |
                   | view man              | b                             | a.ron@1~a.ron
                   | converge              | b.json                        | a.ron~-o
--exposure         | file view             | 0 -2.5 +1 64                  | 65 -65 nan inf 2EV x
--tonemap          | file                  | none filmic agx aces          | nosuch Filmic
--gamma            | file                  | 0.1 1 2.2                     | 0 -1 100 nan inf x
--bits             | file                  | 8 16                          | 32 0 -8 8bit
--metadata         | file                  | none image all                | nosuch All
--stats            | render resume         | b.json -                      | a.ron
--json             | render resume         | . - b.json                    | a.ron~overwrite
                   | tradeoff converge     | . - b.json                    | a.ron
                   | check                 | . - b.json                    | a.ron
                   | compare               | . - b.json                    | a.png
                   | evaluate              | . - b.json                    | others/1.pfm seeds/1.pfm
                   | info                  | . - b.json                    |
                   | doctor                | . b.json                      |
                   | bench view            | . - b.json                    | a.ron
--html             | compare               | b.html b.HTM                  | a.png b.txt
--reference        | evaluate              | sky.pfm others                | nosuch.pfm@1~nosuch a.png@1~a.png
--max-rel-mse      | compare               | 0 1e-3 inf                    | -1 nan 5% x
--write            | check                 | {n}.ron                       | a.ron~itself b.txt~RON

# Messages. --watch never runs, because only an interrupt ends it.
--quiet            | render resume         | .                             |
                   | tradeoff              | .                             |
--verbose          | render resume         | .                             |
--display          | render                | tev://127.0.0.1:1@1           | nosuch TEV tev: tev://:1
                   | render                | tev://[::1]:1@1               | tev://a:0 tev://a:x http://a
--watch            | render                | never                         |

# Measurements.
--quick            | report                | .                             |
--spheres          | report                | 10 100                        | 0 9 -1 1.5 x
--knobs            | tradeoff converge     | depth depth,clamp sampler     | nosuch Depth
                   | tradeoff converge     |                               | "" depth,
--seeds            | tradeoff converge     | 4 5                           | 0 3 1025 -1 4.5 x
--levels           | tradeoff              | 1                             | 0 -1 1,,2 1,x 1.5
--against          | tradeoff              | others                        | nosuch@1~nosuch
--frames           | evaluate              | .                             |
--reference-spp    | tradeoff converge     | 1 8                           | 0 -1 1.5 x
--cache            | tradeoff converge     | b                             |
--first            | converge              | 1                             | 0 2 -1 1.5 x
--last             | converge              | 4 5                           | 0 1 -1 1.5 x

# Frames. A window opens without --headless, so each form of view has it.
--history          | view                  | 0 1024                        | 1025 -1 1.5 x
--history-clamp    | view                  | 0 2.5 inf                     | -1 nan x
--scale            | view                  | 0.05 0.5 1                    | 0 0.04 1.01 -1 nan inf 50%
--moving-fps       | view                  | 0 9.5 1000                    | 1001 -1 nan inf x
--enough           | view                  | 1 4096                        | 0 -1 1.5 x
--split            | view                  | 0 0.5 1                       | 1.1 -0.1 nan inf 50%
--headless         | view                  | .                             |
--camera-path      | view                  | path.ron                      | nosuch.ron@4~nosuch.ron

# Several processes.
*--distribute      | render                | rows average auto             | nosuch Rows
                   | resume                | rows auto                     | nosuch average
                   | view                  | rows                          | average auto nosuch
*--block           | cluster               | 1 1024                        | 0 3 2048 -1 x
*--spare           | cluster               | refuse cpu share              | nosuch
*--broadcast-scene | cluster               | .                             |
*--patience        | cluster               | 2 1m 24h                      | 1 1.5s 25h 0 -1 nan 1x
*--counts          | cluster               | 1                             | 0 2 1, -1 x
*--frame-spp       | cluster               | 1,2                           | 0 257 -1 x
*--average-spp     | cluster               | 1                             | 0 -1 1.5 x
*--noise-spp       | cluster               | 1                             | 0 4097 -1 x
*--sync            | cluster               | gather allreduce              | nosuch gather,
                   | cluster               | gather,allreduce              |

[--distribute=rows]
*--block           | ranks                 | 1 1024                        | 0 3 2048 -1 x
*--spare           | ranks                 | refuse cpu share              | nosuch
*--broadcast-scene | ranks                 | .                             |
*--patience        | ranks                 | 2s 24h                        | 1 1.5s 25h 0 -1 nan 1x
*--balance         | ranks                 | static dynamic                | nosuch
*--write-partial   | ranks                 | .                             |
"#;

/// Command lines beside the table, their exit codes and a word of standard error: old names of
/// options, options that are given twice, or need or exclude others, and commands without options.
pub const COMMANDS: &[(&str, i32, &str)] = &[
    ("", 2, "Usage"),
    ("nosuch", 2, "nosuch"),
    ("help", 0, ""),
    ("help bench report", 0, ""),
    ("completions", 2, "<SHELL>"),
    ("completions tcsh", 2, "<SHELL>"),
    ("completions bash", 0, ""),
    ("completions elvish", 0, ""),
    ("completions fish", 0, ""),
    ("completions powershell", 0, ""),
    ("completions zsh", 0, ""),
    ("check", 2, "<SCENE>"),
    ("check nosuch.ron", 4, "nosuch.ron"),
    ("evaluate", 2, "<FOLDER>"),
    ("evaluate seeds", 2, "--reference"),
    ("evaluate nosuch --reference=sky.pfm", 1, "nosuch"),
    ("compare a.png", 2, "<REFERENCE>"),
    ("compare a.png sky.pfm --max-rel-mse=0", 5, ""),
    ("bench a.ron report", 2, "report"),
    ("merge --output=b.png", 2, "<FILES>"),
    ("merge done.ckpt", 2, "--output"),
    ("render a.ron --samples=64 --checkpoint={n}.ckpt", 2, "for a number of samples use --spp"),
    (
        "render parts.ron --output=b.png --samples 0..256 --checkpoint={n}.ckpt",
        0,
        "note: --samples is now --sample-range",
    ),
    (
        "bench report --backend=cpu --quick --resolution=8x4 --spheres=10 --out b",
        0,
        "note: --out is now --output",
    ),
    ("check a.ron --output={n}.ron", 0, ""),
    ("render a.ron --output=b.exr --aov=normal --aov=depth", 0, ""),
    ("render a.ron --output=b.png --set=image.width=8 --set=image.height=8", 0, ""),
    ("render a.ron --seed=1 --seed=2", 2, "--seed"),
    ("render a.ron -q -v", 2, "--quiet"),
    ("render a.ron --json --stats=-", 2, "--stats"),
    ("render a.ron --budget=1s --spp=1", 2, "--spp"),
    ("render a.ron --budget=1s --target-error=1%", 2, "--target-error"),
    ("render a.ron --quality=draft --spp=1", 2, "--spp"),
    ("render a.ron --resolution=16x9 --width=16", 2, "--width"),
    ("render a.ron --resolution=16x9 --height=9", 2, "--height"),
    ("render a.ron --every=1s", 2, "--checkpoint"),
    ("render a.ron --sample-range=0..256", 2, "--checkpoint"),
    ("render a.ron --shutter-steps=2", 2, "--shutter"),
    ("render a.ron --frames=0..2 --output=b.png", 4, "none of its models moves"),
    ("render a.ron --device=0", 2, "--device needs --backend"),
    ("resume done.ckpt --device=0", 2, "--backend"),
    ("render a.ron --output=b.png --denoise-color=1", 2, "--denoise-color"),
    ("render a.ron --output=b.png --denoise=off --denoise-levels=1", 2, "--denoise-levels"),
    ("render a.ron --output=b.png --aov=normal", 2, "--aov"),
    ("render a.ron --output=b.exr --tonemap=agx", 2, "--tonemap"),
    ("render a.ron --output=b.exr --gamma=2", 2, "--gamma"),
    ("render a.ron --output=b.jpg --bits=16", 2, "--bits"),
    ("render a.ron --output=b.jpg --background=transparent", 2, "--background"),
    ("view a.ron --frames=1", 2, "--headless"),
    ("view a.ron --json=-", 2, "--headless"),
    ("view a.ron --output=b", 2, "--headless"),
    ("view a.ron --camera-path=path.ron", 2, "--headless"),
    ("view a.ron --headless --output=b --moving-fps=10", 2, "--moving-fps"),
];
