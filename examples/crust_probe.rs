//! probe
use medial::geometry::*; use medial::shape::*; use medial::surface;
fn main(){
 let a:Vec<String>=std::env::args().collect();
 let l=surface::read(&a[1]).unwrap();
 let opt=ShapeOptions{sampling:a[2].parse().unwrap(),..Default::default()};
 let s=Shape::new("x",&l.mesh,l.report.clone(),opt).unwrap();
 let t=std::time::Instant::now();
 let b=s.polar_balls().unwrap();
 let t1=t.elapsed().as_secs_f64();
 let c=PowerCrust::new(&b.inner,&b.outer).unwrap();
 let m=c.triangles();
 let tree=s.surface_tree().unwrap();
 let d=tree.distance_batch(&m.vertices);
 let mx=d.iter().cloned().fold(0.0,f64::max);
 let n=m.vertices.len();
 let mut ls:Vec<f64>=Vec::new();
 for f in 0..c.facet_count(){let r=c.facet(f);for k in 0..r.len(){ls.push(m.vertices[r[k] as usize].distance(m.vertices[r[(k+1)%r.len()] as usize]));}}
 ls.sort_by(f64::total_cmp);
 let cnt=|x:f64|ls.iter().filter(|&&l|l<x).count();
 println!("{} in {} out {} V {} F {} maxd {:.2e} t {:.2} {:.2} genus_exp {:?} n {}",a[1],b.inner.len(),b.outer.len(),n,m.faces.len(),mx,t1,t.elapsed().as_secs_f64(),l.report.genus,ls.len());
 for e in [1e-17,1e-15,1e-14,1e-13,1e-12,1e-11,1e-10,1e-9,1e-8,1e-7,1e-6,1e-5,1e-4,1e-3,1e-2]{print!(" {e:e}:{}",cnt(e));} println!();
 println!("rejected {}",b.rejected);
 for eps in a[3..].iter().map(|e|e.parse::<f64>().unwrap()){
 let t=std::time::Instant::now();
 let c=surface::contract_short_edges(&m,&vec![eps;m.vertices.len()],surface::Folds::Ignored);
 let t=t.elapsed().as_secs_f64();
 let d=tree.distance_batch(&c.mesh.vertices);
 let mx=d.iter().cloned().fold(0.0,f64::max);
 let mut p:Vec<_>=c.mesh.vertices.iter().map(|v|v.to_array().map(|x|(x+0.0).to_bits())).collect(); p.sort();let k=p.len();p.dedup();
 print!("  eps {eps:e} V {} contracted {} refused {} dropped {} coincident {} maxd {mx:.2e} t {t:.2} ",k,c.contracted,c.refused,c.dropped,k-p.len());
 match surface::validate(&c.mesh){Ok(r)=>println!("ok comps {} genus {:?} (exp {:?}/{}) selfint {} degenerate {}",r.components,r.genus,l.report.genus,l.report.components,r.intersecting_pairs,r.degenerate_faces),Err(e)=>println!("err {e}")}
 }
}
