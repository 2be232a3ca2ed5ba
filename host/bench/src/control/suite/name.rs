//! Names of the suites.

named! {
    /// Name of a suite. Each differs from [`QuasiStatic`](Self::QuasiStatic) in the respect given.
    SuiteName:
    QuasiStatic "quasi-static" "the default population";
    Yaw "yaw" "rigs yawed by up to ±20°";
    Tilt "tilt" "motor plane tilted by up to 10°";
    Radii "radii" "each pulley ±30 %";
    Heights "heights" "each motor ±10 cm";
    Noise "noise" "noise of 6, 3, 3 mm";
    Outliers "outliers" "5 % outliers of 50 mm";
    Ages "ages" "latency of 1 to 2 frames, assumed to be 1.5";
    Latency "latency" "latency of 4 frames, assumed to be 1.5";
    Drift "drift" "depth noise AR(1) 0.9 of 2 mm, threshold 3 mm";
    Unilateral "unilateral" "rigid cables that cannot push";
    Bounce4 "bounce4" "a ball mode of 4 Hz, ζ = 0.1";
    Bounce3 "bounce3" "a ball mode of 3 Hz, ζ = 0.1";
    Bounce2 "bounce2" "a ball mode of 2 Hz, ζ = 0.05";
    Elastic "elastic" "0.1-0.3 kg on 800 and 150 N/m in turn";
    Elastic800 "elastic800" "0.1-0.3 kg on 800 N/m";
    Elastic150 "elastic150" "0.1-0.3 kg on 150 N/m";
    Stiff "stiff" "0.1-0.3 kg on 800 N/m, in the rig file too";
    Warm800 "warm800" "0.1-0.3 kg on 800 N/m, a run for each target";
    Warm150 "warm150" "0.1-0.3 kg on 150 N/m, a run for each target";
    WarmMoved "warm-moved" "a run for each target, a motor moved by 5 cm after the first";
    WarmPulleys "warm-pulleys" "a run for each target, pulleys x1.5 or /1.5 after the first";
    Edge "edge" "start and target with λ >= 0.005";
    High "high" "5 to 20 cm below the motors";
    Fine "fine" "threshold 2 mm";
    Frame5 "frame5" "positions turned by 5° about the target";
    Frame10 "frame10" "positions turned by 10° about the target";
    Frame20 "frame20" "positions turned by 20° about the target";
    Planar "planar" "two motors in a plane, rigid cables that cannot push";
    Planar800 "planar800" "two motors in a plane, 0.1-0.3 kg on 800 N/m";
    Planar150 "planar150" "two motors in a plane, 0.1-0.3 kg on 150 N/m";
    Picture "picture" "two motors in the picture of a camera of unknown place, after two jogs; \
                       hold in pixels";
    Picture800 "picture800" "the same, 0.1-0.3 kg on 800 N/m";
    Picture150 "picture150" "the same, 0.1-0.3 kg on 150 N/m";
    PaperTask "paper-task" "the paper's rig and task with the default camera";
}
