#![allow(missing_docs, clippy::all, clippy::pedantic, clippy::unwrap_used)]
use delta_cal::*; use delta_cal::robot::*; use delta_cal::frame::RigidTransform; use delta_cal::simulate::standard_normal;
use delta_cal_host::files::{input_text::InputText, robot_file::RobotFile, samples_file::*};
use delta_cal_host::fit::{solve, Options, Frame, Method};
use nalgebra::*; use rand_pcg::Pcg32; use rand_core::{SeedableRng, Rng};
fn main() {
    let geos = [(194.,30.,260.,480.),(200.,45.,235.,800.),(60.,40.,400.,900.),(60.,110.,250.,520.),(150.,60.,250.,275.)];
    let mode = std::env::args().nth(1).unwrap_or("base".into());
    let stated = std::env::args().nth(2).map_or(true, |s| s=="stated");
    let poses: usize = std::env::args().nth(3).map_or(20, |s| s.parse().unwrap());
    for (b,p,u,f) in geos {
        let toml = format!("[nominal]\nbase_radius_mm={b}\nplatform_radius_mm={p}\nupper_arm_mm={u}\nforearm_mm={f}\n[joints]\nmin_deg=-60\nmax_deg=70\n[tolerance]\nlength_mm=0.5\nangle_deg=0.2\n{}", if stated {"[noise]\nposition_mm=0.02\njoint_deg=0.002\n"} else {""});
        let file = RobotFile::read(&InputText::new("r", &toml)).unwrap();
        let (mut zz, mut nz, mut pe, mut ps, mut re, mut rs, mut refused, mut ratio) = (0.,0.,0.,0.,0.,0.,0,0.0);
        let robots = 40; let t0=std::time::Instant::now(); let mut solving=0.0;
        for seed in 0..robots {
            let mut rng = Pcg32::seed_from_u64(seed + 1000*(b as u64 + f as u64));
            let truth = delta_cal::simulate::made_robot(&file.robot, &file.tolerance.unwrap(), &mut rng).unwrap();
            let mut n = || standard_normal::<f64,_>(&mut rng);
            let rot = Rotation3::new(Vector3::new(n(),n(),n()));
            let tr = Vector3::new(500.*n(),500.*n(),500.*n());
            let mut samples = Vec::new();
            while samples.len() < poses {
                let q: [f64;3] = std::array::from_fn(|_| (-50.0 + 100.0*(rng.next_u32() as f64)/(u32::MAX as f64)).to_radians());
                let Ok(x) = truth.forward(&q) else {continue}; if file.robot.forward(&q).is_err() {continue}
                if !file.reach().clear_position(&file.robot,&q).is_ok() {continue}
                let mut n = || standard_normal::<f64,_>(&mut rng);
                let x = x + Vector3::new(n(),n(),n())*0.02;
                let q = q.map(|q| q + 0.002f64.to_radians()*n());
                let x = if mode=="sensor" { rot*x+tr } else {x};
                samples.push(Sample{joints:q, position:x});
            }
            let readings = Readings::of_samples("s", &samples);
            let options = Options { frame: if mode=="sensor" {Frame::Sensor} else {Frame::Base}, method: match mode.as_str() {"fkm"=>Some(Method::Fkm),"ikm"=>Some(Method::Ikm),_=>None}, loss: None };
            let t1=std::time::Instant::now();
            let s = match solve(&file,&readings,&options) { Ok(s)=>s, Err(e)=>{ refused+=1; if refused<3 {eprintln!("{e:?}");} continue}};
            solving += t1.elapsed().as_secs_f64();
            ratio += s.levels.position.position();
            for a in 0..3 { for i in 0..8 { let mut d = s.robot.parameters()[a][i]-truth.parameters()[a][i]; if i==3 { while d>3. {d-=std::f64::consts::TAU} while d< -3. {d+=std::f64::consts::TAU} } zz += d*d/s.covariance[(8*a+i,8*a+i)]; nz+=1.; }}
            // positions
            let c = s.of_parameters();
            let mut k=0; let (mut e2, mut s2)=(0.,0.); let mut pairs=vec![];
            while k<60 { let q: [f64;3] = std::array::from_fn(|_| (-50.0 + 100.0*(rng.next_u32() as f64)/(u32::MAX as f64)).to_radians()); let (Ok(xt),Ok(xs))=(truth.forward(&q),s.robot.forward(&q)) else {continue}; if !file.reach().clear_position(&file.robot,&q).is_ok() {continue}
               let j = s.robot.platform_jacobian(&xs,&q).unwrap().by_parameters; let mut jj = SMatrix::<f64,3,24>::zeros(); for a in 0..3 { jj.fixed_columns_mut::<8>(8*a).copy_from(&j[a]); }
               e2 += (xt-xs).norm_squared(); s2 += (jj*c*jj.transpose()).trace(); pairs.push((xs,xt)); k+=1; }
            pe+=e2/60.; ps+=s2/60.;
            let fr = RigidTransform::align(pairs.iter().copied()).unwrap(); re += pairs.iter().map(|(a,b)| (fr.apply(a)-b).norm_squared()).sum::<f64>()/60.;
            let exp = delta_cal_host::accuracy::expected_error::ExpectedError::of(&delta_cal_host::accuracy::position_uncertainty::PositionUncertainty{robot:&s.robot,covariance:&c}, &file.reach(), &delta_cal_host::accuracy::workspace_poses::WorkspacePoses::within(&s.robot,&file.reach())).unwrap(); rs += exp.intrinsic.rms.powi(2);
        }
        let m = (robots-refused) as f64;
        println!("{b}/{p}/{u}/{f}: z {:.3} abs {:.4} stated {:.4} ({:.3}) rel {:.4} stated {:.4} ({:.3}) refused {refused} sigma {:.4} solve {:.1} ms", (zz/nz).sqrt(), (pe/m).sqrt(), (ps/m).sqrt(), (pe/ps).sqrt(), (re/m).sqrt(), (rs/m).sqrt(), (re/rs).sqrt(), ratio/m, 1e3*solving/m);
    }
}
