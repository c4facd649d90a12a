mod compare;
use compare::*;
use std::path::Path;
use upbp_core::*;
use upbp_scene::ReadyScene;
use std::ops::ControlFlow;
fn main(){
    let args: Vec<String> = std::env::args().collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let time: f64 = args[1].parse().unwrap();
    for scene in args[2].split(',') { for set in args[3].split(',') {
        let s = ReadyScene::load(root.join(format!("examples/scenes/reference/{scene}.ron"))).unwrap();
        let r = Reference::read(&root.join(format!("tests/data/references/{scene}.exr"))).unwrap();
        let settings = Settings{techniques:set.parse().unwrap(), seed: args.get(4).map_or(0,|s|s.parse().unwrap()), min_length: args.get(5).map_or(1,|s|s.parse().unwrap()), max_length: args.get(6).map_or(1000,|s|s.parse().unwrap()), ..Settings::default()};
        let mut renderer = Renderer::new(&s, settings.validate().unwrap()).unwrap();
        let mut spread = Spread::default();
        renderer.render(&Stop{seconds:Some(time),..Stop::default()}, |p| {spread.add(p.film); ControlFlow::Continue(())});
        let m=spread.mean(); println!("  mean {:.6} {:.6} {:.6} err {:.6} {:.6} {:.6}",m[0].mean,m[1].mean,m[2].mean,m[0].error,m[1].error,m[2].error); let c = Comparison::new(renderer.film(), &spread, &r);
        println!("{scene:18} {set:24} n={:5} sig {:+.2} {:+.2} {:+.2}  % {:+.3} {:+.3} {:+.3} e% {:.3} chi2 {:.3} out% {:.2} tile {:.2} relmse {:.2e} floor {:.1e}", renderer.film().iterations(), c.sigmas[0],c.sigmas[1],c.sigmas[2],c.percent[0],c.percent[1],c.percent[2], 100.0*c.mean[1].error/c.mean[1].mean, c.chi_square, 100.0*c.outliers, c.tile, c.relative_mse, r.floor());
    }}
}
