; One tower becomes another.
(define (problem four-blocks-restack)
  (:domain blocksworld)
  (:objects
    green_block purple_block red_block yellow_block - block
    arm - robot)
  (:init
    (handempty arm)
    (ontable green_block) (on yellow_block green_block) (on red_block yellow_block) (on purple_block red_block) (clear purple_block))
  (:goal (and
    (on green_block red_block)
    (on purple_block green_block)
    (on yellow_block purple_block))))
